"""The page in the browser: a saved result, or two fields, looked at and worked with."""
