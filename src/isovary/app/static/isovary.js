/* What the page does by itself: linked cameras, the address that keeps a state, screenshots. */
(function () {
  "use strict";

  const PREFIX = "view_";
  let pressed = null;

  function views() {
    const refs = window.trame ? window.trame.refs : {};
    return Object.keys(refs)
      .filter((name) => name.startsWith(PREFIX) && refs[name] && refs[name].getCamera)
      .map((name) => ({ name, view: refs[name], box: document.getElementById(name) }))
      .filter((found) => found.box && found.box.offsetParent !== null);
  }

  let current = null; // the camera of all views
  let turned = false; // by hand, since they were told where to look from

  /* The other views look from where this one does. */
  function link(name) {
    const own = window.trame.refs[name];
    if (!own) return;
    current = own.getCamera();
    turned = true;
    for (const { name: other, view } of views()) if (other !== name) view.setCamera(current);
  }

  /* All views look from there, farther away where a view is narrower than high. */
  function look(camera) {
    const shown = views();
    const aspects = shown.map(({ box }) => box.clientWidth / Math.max(box.clientHeight, 1));
    const farther = 1 / Math.min(1, ...aspects);
    const position = camera.position.map(
      (x, i) => camera.focalPoint[i] + farther * (x - camera.focalPoint[i])
    );
    current = { ...camera, position };
    turned = false;
    for (const { view } of shown) view.setCamera(current);
  }

  /* A view that was not there, or hidden, or of another size, joins the others. */
  function join(name) {
    const own = window.trame.refs[name];
    const asked = window.trame.state.get("camera");
    if (current && (turned || !asked)) own.setCamera(current);
    else if (asked) look(asked);
  }

  /* Words stand in a view until its surface is drawn. The scene that came tells of the surface;
     it is drawn in one of the next two frames. */
  function loaded(name, scene) {
    const box = document.getElementById(name);
    const surface = scene && actors(scene).find((actor) => meshed(actor));
    if (!box || !surface) return;
    const seen = surface.properties.visibility !== 0; // left out where it is as before
    const tell = () => box.toggleAttribute("data-drawn", seen);
    requestAnimationFrame(() => requestAnimationFrame(tell));
  }

  function actors(part) {
    const own = /Actor$/.test(part.type) ? [part] : [];
    return own.concat(...(part.dependencies || []).map(actors));
  }

  function meshed(part) {
    const polys = part.properties && part.properties.polys;
    return !!polys || (part.dependencies || []).some(meshed);
  }

  /* A click that ends a drag is no click. */
  document.addEventListener("pointerdown", (e) => (pressed = [e.clientX, e.clientY]), true);
  let last = [0, 0];
  document.addEventListener("pointerup", (e) => (last = [e.clientX, e.clientY]), true);
  function dragged() {
    return !!pressed && Math.hypot(last[0] - pressed[0], last[1] - pressed[1]) > 4;
  }

  /* The drawer scrolls to a part of it, or to its top. */
  function reveal(id) {
    setTimeout(() => {
      const part = id ? document.getElementById(id) : null;
      const drawer = document.querySelector(".v-navigation-drawer__content");
      if (part) part.scrollIntoView({ block: "nearest" });
      else if (drawer) drawer.scrollTop = 0;
    }, 100);
  }

  function remember(text) {
    const page = location.pathname + location.search; // "#" alone would be of the base address
    if (text) history.replaceState(history.state, "", page + "#" + text);
  }

  function arrival() {
    return {
      link: location.hash.slice(1),
      dark: window.matchMedia("(prefers-color-scheme: dark)").matches,
      narrow: window.innerWidth < 900,
    };
  }

  function save(url, name) {
    const anchor = document.createElement("a");
    anchor.href = url;
    anchor.download = name;
    anchor.click();
  }

  /* All views that are shown, as they stand on the page, with their titles and keys. */
  async function screenshot(title, name, times) {
    const shown = views();
    const boxes = shown.map(({ box }) => box.getBoundingClientRect());
    const left = Math.min(...boxes.map((b) => b.left));
    const top = Math.min(...boxes.map((b) => b.top));
    const right = Math.max(...boxes.map((b) => b.right));
    const bottom = Math.max(...boxes.map((b) => b.bottom));
    const scale = times * (window.devicePixelRatio || 1);
    const head = 36;
    const canvas = document.createElement("canvas");
    canvas.width = (right - left) * scale;
    canvas.height = (bottom - top + head) * scale;
    const pen = canvas.getContext("2d");
    pen.scale(scale, scale);
    const style = getComputedStyle(document.querySelector(".v-application"));
    pen.fillStyle = style.backgroundColor;
    pen.fillRect(0, 0, canvas.width, canvas.height);
    pen.fillStyle = style.color;
    pen.font = "600 16px sans-serif";
    pen.fillText(title, 12, 24);
    for (let k = 0; k < shown.length; k++) {
      const picture = new Image();
      picture.src = URL.createObjectURL(await shown[k].view.captureImage("image/png", { scale: times }));
      await picture.decode();
      URL.revokeObjectURL(picture.src);
      const b = boxes[k];
      pen.drawImage(picture, b.left - left, b.top - top + head, b.width, b.height);
      for (const part of shown[k].box.querySelectorAll("[data-print]")) {
        const at = part.getBoundingClientRect();
        const size = parseFloat(getComputedStyle(part).fontSize);
        const x = at.left - left;
        const y = at.top - top + head;
        if (part.dataset.print === "text") {
          pen.fillStyle = style.color;
          pen.font = getComputedStyle(part).fontWeight + " " + size + "px sans-serif";
          pen.fillText(part.innerText.replace(/\s+/g, " "), x, y + size);
        } else if (part.dataset.print === "bar") {
          const colors = part.dataset.colors.split(" ");
          colors.forEach((color, i) => {
            pen.fillStyle = color;
            pen.fillRect(x + (at.width * i) / colors.length, y, at.width / colors.length + 1, at.height);
          });
        } else {
          pen.fillStyle = getComputedStyle(part).backgroundColor;
          pen.fillRect(x, y, at.width, at.height);
        }
      }
    }
    save(canvas.toDataURL("image/png"), name);
  }

  async function upload(file, role) {
    const answer = await fetch("upload/" + role, {
      method: "POST",
      headers: { "X-File-Name": encodeURIComponent(file.name) },
      body: file,
    });
    return answer.ok ? "" : await answer.text();
  }

  /* Asks again and again whether the server is back, and says what it found. */
  async function comeBack() {
    const begun = performance.now();
    const words = document.getElementById("lost_words");
    const button = document.getElementById("lost_reload");
    while (words.isConnected) {
      await new Promise((wake) => setTimeout(wake, 700));
      const answer = await fetch(location.pathname, { method: "HEAD" }).catch(() => null);
      if (!words.isConnected) return;
      button.hidden = !answer || ![404, 410].includes(answer.status);
      if (!answer) words.textContent = performance.now() - begun < GIVES_UP ? COMING : ENDED;
      else if (answer.ok) await window.trame.connect().catch(() => null);
      else words.textContent = button.hidden ? ANOTHER : OVER;
    }
  }

  const GIVES_UP = 8000; // milliseconds
  const COMING = "Trying to come back…";
  const ENDED = "The server has ended. Start isovary view again, and open the address that it prints.";
  const ANOTHER = "Another server answers. Open the address that it printed.";
  const OVER = "This session has ended. Reload, and a new one begins.";

  window.isovary = {
    link, look, join, loaded, dragged, reveal, remember, arrival, save, screenshot, upload,
    comeBack, reload: () => location.reload(),
  };
})();
