"""How meshes look in notebooks."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from html import escape
from typing import Any

from ._errors import Error
from ._figures import png

# Pixels of a picture.
SIZE = (360, 270)


def html(mesh: Any, figures: Mapping[str, Any]) -> str:
    """A picture of a mesh beside a table of figures; the table alone where nothing can be drawn."""
    rows = "".join(
        f"<tr><td>{escape(name)}</td><td>{escape(str(value))}</td></tr>" for name, value in figures.items()
    )
    try:
        data = base64.b64encode(png(mesh, SIZE)).decode()
    except Error:
        return f"<table>{rows}</table>"
    picture = f'<img src="data:image/png;base64,{data}" width="{SIZE[0]}" height="{SIZE[1]}"/>'
    return f"<table><tr><td>{picture}</td><td><table>{rows}</table></td></tr></table>"
