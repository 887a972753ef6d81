"""Griffe extension: the comment beside a field documents it in the API reference.

Records of this project carry units and meaning in a comment at the end of the line:
`speed: float  # along the heading [m/s]`. Static analysis drops comments.
"""

import io
import tokenize
from typing import Any

import griffe


class FieldComments(griffe.Extension):
    """Use the comments on a field's own lines as its docstring."""

    def on_attribute(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Document a field of a class or module that has a comment only."""
        if attr.docstring is None and (comment := _comment(attr.source)):
            attr.docstring = griffe.Docstring(comment, parent=attr)


def _comment(source: str) -> str:
    """Return the comments in a few lines of source, joined; "" if there are none."""
    lines = io.StringIO(source.strip()).readline
    try:
        return " ".join(
            token.string.lstrip("# ")
            for token in tokenize.generate_tokens(lines)
            if token.type == tokenize.COMMENT and not token.string.startswith("# noqa")
        )
    except tokenize.TokenError:
        return ""
