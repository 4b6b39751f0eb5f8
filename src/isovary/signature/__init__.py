"""Room: Eigenpairs, times -> signature (n, T) (thesis 3.1, 4.2.6)."""

from ._heat_kernel import heat_kernel_signature

__all__ = ["heat_kernel_signature"]
