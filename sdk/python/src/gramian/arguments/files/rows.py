"""Clouds as rows of numbers: XYZ, CSV and the like. docs/formats.md has the rules ("Rows of numbers")."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from .arrays import text_of
from .columns import NORMALS, POSITIONS, FileCloud
from .records import text_columns

DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)
WITH_COMMA = re.compile(r"[+-]?\d+,\d+(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)
LIKE_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""Groups of three digits: thousands are written so too."""
MISSING = re.compile(r"[+-]?nan", re.IGNORECASE)
OF_MARKS = re.compile(r"[\d.,'\"+\- ]*", re.ASCII)
"""Texts of digits, signs, quotes, separators and marks of numbers alone."""
SKIPPED = re.compile(r"[ \t]*($|#|//)")

SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "spaces"}
"""Separators with their names, in the order in which they are looked for."""

MAX_DEVIATION = 0.01
"""The largest deviation of the lengths of normals from 1, for two decimals of each component."""

NO_ROWS = "the file has no rows"


def read_rows(content: bytes) -> FileCloud:
    """Reads a table.

    Raises
    ------
    ValueError
        If the table leaves open what it says, or a cell is no number. Says in which line.
    """
    lines = [
        (number, line.removesuffix("\r"))
        for number, line in enumerate(text_of(content).split("\n"), 1)
        if not SKIPPED.match(line.removesuffix("\r"))
    ]
    count = _take_count(lines)
    if not lines:
        raise ValueError(NO_ROWS)
    head = Head(*lines[0])
    names = head.names()
    rows = lines[1:] if head.has_names else lines
    numbers = Numbers()
    table = [_row(number, text, head, numbers) for number, text in rows]
    if not rows:
        raise ValueError(NO_ROWS)
    numbers.check(head)
    if count is not None:
        _check_count(*count, len(rows))
    if not head.has_names and len(names) == 6 and _are_normals(table):
        names[3:] = NORMALS[0]
    return text_columns(names, table, [number for number, _ in rows]).cloud()


def _take_count(lines: list[tuple[int, str]]) -> tuple[int, str] | None:
    """Takes the number of points from the lines, if there is one, and the comment that may follow in XYZ files."""
    if not lines or not re.fullmatch(r"[ \t]*\d+[ \t]*", lines[0][1], re.ASCII):
        return None
    number, text = lines.pop(0)
    if lines and lines[0][0] == number + 1 and Head(*lines[0]).is_comment():
        lines.pop(0)
    return number, text.strip()


def _check_count(line: int, announced: str, n_rows: int) -> None:
    if int(announced) == n_rows:
        return
    points = "point" if int(announced) == 1 else "points"
    follow = "1 row follows" if n_rows == 1 else f"{n_rows} rows follow"
    raise ValueError(f"line {line} announces {announced} {points}, but {follow}")


def _row(number: int, text: str, head: Head, numbers: Numbers) -> list[float]:
    cells = cells_of(text, head.separator)
    if len(cells) != len(head.cells):
        raise ValueError(head.width_refusal(number, len(cells)))
    return [
        numbers.read(cell, f"line {number}:", column=column, may_miss=head.may_miss[column])
        for column, cell in enumerate(cells)
    ]


def _are_normals(table: Sequence[Sequence[float]]) -> bool:
    lengths = np.linalg.norm(np.array(table)[:, 3:], axis=1)
    return bool((np.abs(lengths - 1) <= MAX_DEVIATION).all())


def _separator_of(line: str) -> str:
    """Returns the separator of a line. Commas between spaces are decimal marks, if every word is such a number."""
    found = next((separator for separator in SEPARATORS if separator in line), " ")
    words = [word for word in line.split(" ") if word]
    if found == "," and len(words) >= 2 and all(map(WITH_COMMA.fullmatch, words)):
        return " "
    return found


def cells_of(line: str, separator: str) -> list[str]:
    """Returns the cells of a line, without blanks and quotes around them."""
    cells: Iterator[str] | list[str] = line.split(separator)
    if separator == " ":
        cells = filter(None, cells)
    return [re.sub(r'^"(.*)"$', r"\1", cell.strip(" \t")) for cell in cells]


def _is_numeric(cell: str) -> bool:
    return any(known.fullmatch(cell) for known in (DECIMAL, WITH_COMMA, MISSING))


def _is_name(cell: str) -> bool:
    """Tells whether a text can name a column: it has more than digits and marks, and is no number."""
    return not OF_MARKS.fullmatch(cell) and not _is_numeric(cell)


@dataclass
class Head:
    """The first line of a table, which decides separator and number of columns."""

    line: int
    text: str
    separator: str = field(init=False)
    cells: list[str] = field(init=False)
    has_names: bool = field(init=False)
    may_miss: list[bool] = field(init=False)

    def __post_init__(self) -> None:
        self.separator = _separator_of(self.text)
        self.cells = cells_of(self.text, self.separator)
        self.has_names = any(self.cells) and all(cell == "" or _is_name(cell) for cell in self.cells)
        geometric = {name for group in (POSITIONS, *NORMALS) for name in group}
        names = self.cells if self.has_names else [*POSITIONS, *([""] * len(self.cells))]
        self.may_miss = [name.lower() not in geometric for name in names]

    def is_comment(self) -> bool:
        """Tells whether a line after the number of points is none of the table."""
        if self.has_names:
            return not self._has_positions()
        return not all(map(_is_numeric, self.cells))

    def _has_positions(self) -> bool:
        lower = [cell.lower() for cell in self.cells]
        return "x" in lower and "y" in lower

    def names(self) -> list[str]:
        """Returns the names of all columns. Columns without one are numbered."""
        numbered = [f"column {at}" for at in range(1, len(self.cells) + 1)]
        if not self.has_names:
            if len(self.cells) < 2:
                raise ValueError(f"line {self.line}: a row has at least two coordinates")
            return [*POSITIONS, *numbered[3:]][: len(self.cells)]
        if not self._has_positions():
            raise ValueError(f"line {self.line} names no columns x and y: {', '.join(self.cells)}")
        names = [cell or number for cell, number in zip(self.cells, numbered, strict=True)]
        lower = [name.lower() for name in names]
        for at, name in enumerate(lower):
            if name in lower[:at]:
                raise ValueError(f"line {self.line} names {name} twice")
        return names

    def width_refusal(self, line: int, width: int) -> str:
        """Returns the refusal of a row with another number of cells."""
        cells = f"{width} {'cell' if width == 1 else 'cells'} between {SEPARATORS[self.separator]}"
        remedy = ". Numbers with decimal commas need semicolons or tabs between them" if self.separator == "," else ""
        return f"line {line} has {cells}, but line {self.line} has {len(self.cells)}{remedy}"


class Numbers:
    """Reads numbers, which have either decimal points or decimal commas throughout a file."""

    def __init__(self) -> None:
        self.has_point = False
        self.doubt: str | None = None
        """The refusal of the first number with a comma, should commas be doubtful."""
        self.are_decimal = False
        """Whether commas cannot stand for thousands."""

    def read(self, cell: str, at: str, *, column: int, may_miss: bool) -> float:
        """Returns the number that a cell is."""
        if cell == "":
            raise ValueError(f"{at} cell {column + 1} is empty")
        quoted = f'"{cell[:40]}"'
        has_comma = WITH_COMMA.fullmatch(cell) is not None
        is_number = has_comma or DECIMAL.fullmatch(cell) or (may_miss and MISSING.fullmatch(cell))
        if not is_number:
            remedy = ". Use one separator between columns, and none within numbers" if OF_MARKS.fullmatch(cell) else ""
            raise ValueError(f"{at} {quoted} is no number{remedy}")
        number = float(cell.replace(",", "."))
        if np.isinf(number):
            raise ValueError(f"{at} {quoted} is too large")
        if has_comma:
            if self.has_point:
                raise ValueError(f"{at} {quoted} has a decimal comma, numbers before it a decimal point")
            self.doubt = self.doubt or f"{at} {quoted} may be a decimal number or thousands. Write decimal points"
            self.are_decimal |= LIKE_THOUSANDS.fullmatch(cell) is None
        elif "." in cell:
            if self.doubt is not None:
                raise ValueError(f"{at} {quoted} has a decimal point, numbers before it a decimal comma")
            self.has_point = True
        return number

    def check(self, head: Head) -> None:
        """Refuses a table whose commas can be read in two ways."""
        if self.doubt is not None and not self.are_decimal:
            raise ValueError(self.doubt)
        # Decimal commas double the number of columns, and leave no point.
        n = len(head.cells)
        may_be_torn = head.separator == "," and not head.has_names and n >= 4 and n % 2 == 0
        if may_be_torn and not self.has_point:
            remedy = "Name the columns in a first line, or write decimal points"
            raise ValueError(f"line {head.line}: commas may be decimal marks here. {remedy}")
