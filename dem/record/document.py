"""JSON files of a run directory, read with a complaint in one line for whatever is not what it should be."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from dem.record.files import cannot_read

REMEDY = "give the directory of a run made by this version of `smarticles run`"


@dataclass(frozen=True)
class Document:
    """A JSON object with its file, so that every complaint can name both.

    Args:
        path: the file.
        data: its content, or an object in it.
    """

    path: Path
    data: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path) -> Document:
        """The object that a file holds.

        Raises:
            InputError: There is none.
        """
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            cannot_read("manifest", path, error, REMEDY)
        if not isinstance(data, dict):
            cannot_read("manifest", path, "it holds no JSON object", REMEDY)
        return cls(path, data)

    def _get(self, key: str) -> Any:
        try:
            return self.data[key]
        except KeyError:
            cannot_read("manifest", self.path, f"key '{key}' is missing", REMEDY)

    def _refuse(self, key: str, value: object, wanted: str) -> NoReturn:
        cannot_read("manifest", self.path, f"'{key}' must be {wanted}: got {value!r}", REMEDY)

    def text(self, key: str) -> str:
        """Text.

        Raises:
            InputError: There is none.
        """
        value = self._get(key)
        if not isinstance(value, str):
            self._refuse(key, value, "text")
        return value

    def integer(self, key: str, *, least: int = 0) -> int:
        """A whole number, no less than the least.

        Raises:
            InputError: There is none.
        """
        value = self._get(key)
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            self._refuse(key, value, f"a whole number, {least} or more")
        return value

    def number(self, key: str, *, positive: bool = False) -> float:
        """A finite number, not negative.

        Raises:
            InputError: There is none.
        """
        value = self._get(key)
        wanted = "a finite number > 0" if positive else "a finite number >= 0"
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._refuse(key, value, wanted)
        if not math.isfinite(value) or value < 0 or (positive and value == 0):
            self._refuse(key, value, wanted)
        return float(value)

    def phases(self) -> list[Document]:
        """The objects in its list of phases.

        Raises:
            InputError: There is none.
        """
        value = self._get("phases")
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            self._refuse("phases", value, "a list of objects")
        return [Document(self.path, item) for item in value]
