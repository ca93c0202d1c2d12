"""Widths of text, in every file under version control that people wrote.

- A line of comment has at most 110 columns, in any language. A comment behind code and a docstring are held by the formatter
  of their language.
- A line of Markdown has at most 140 columns. Tables, blocks of code, pictures, and lines without a place to break may have more.

Data, vendored files and generated ones are left out.
"""

import re

MAX_COMMENT = 110
MAX_MARKDOWN = 140

SLASHES = ("//", "/*", "*/")
HASHES = ("#", None, None)
# What begins a line of comment, and what begins and ends a block of them.
MARKS = {
    **dict.fromkeys((".rs", ".js", ".mjs", ".ts", ".java", ".cs", ".go", ".cpp"), SLASHES),
    **dict.fromkeys((".py", ".sh", ".toml", ".yaml", ".yml", ".cfg", ".conf", ".tpl", ".txt"), HASHES),
    **dict.fromkeys(("Dockerfile", ".dockerignore", ".gitignore"), HASHES),
    ".css": (None, "/*", "*/"),
    ".html": (None, "<!--", "-->"),
}


def wide_lines(path, name):
    """Complaints about the lines of a file that are too wide."""
    if path.suffix == ".md":
        found, limit, kind = markdown_lines, MAX_MARKDOWN, "a line"
    else:
        found, limit, kind = comment_lines, MAX_COMMENT, "a comment"
    for number, line in found(path):
        if len(line) > limit:
            yield f"{name}:{number} is {kind} of {len(line)} columns, over {limit}"


def comment_lines(path):
    """Lines that hold nothing but comment, with their numbers. None where the language is not known."""
    text = path.read_text(errors="replace")
    marks = HASHES if text.startswith("#!") else MARKS.get(path.suffix) or MARKS.get(path.name)
    if not marks:
        return
    mark, opening, closing = marks
    is_inside = False
    for number, line in enumerate(text.splitlines(), 1):
        words = line.strip()
        is_inside = is_inside or (opening is not None and words.startswith(opening))
        if is_inside or (mark is not None and words.startswith(mark)):
            yield number, line
        is_inside = is_inside and closing not in words


def markdown_lines(path):
    """Lines of prose that could be broken, with their numbers."""
    is_code = False
    for number, line in enumerate(path.read_text().splitlines(), 1):
        words = line.strip()
        if words.startswith("```"):
            is_code = not is_code
        elif not is_code and not words.startswith(("|", "![", "[![")) and re.search(r"\S\s", words[:MAX_MARKDOWN]):
            yield number, line
