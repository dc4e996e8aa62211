"""A file that is changed in place, completely or not at all, which HDF5 itself does not offer.

Changes stay in memory until `Journaled.commit`. It stores the old content of all changed pages in a second file, the
journal, changes the file, and removes the journal. A process that ends in between leaves the journal, from which the
next process restores the file. A full disk causes an error in `commit`, not in the HDF5 library.

Source: the rollback journal of SQLite, https://www.sqlite.org/atomiccommit.html
"""

import contextlib
import io
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from dem.record.files import whole

PAGE = 4096  #: Size of a page, the unit of reading and storing [bytes]
_NUMBER = 8  # bytes of a whole number in a journal


class Journaled(io.RawIOBase):
    """A file object for reading and writing, which writes changes to the disk in `commit` only.

    OSError if the file or its journal cannot be read; ValueError if the journal is damaged.
    """

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path
        self._disk = path.open("rb")
        self._place = 0
        found = read_journal(path)
        self._size, pages = (os.fstat(self._disk.fileno()).st_size, {}) if found is None else found
        self._pages = {number: bytearray(content) for number, content in pages.items()}

    def close(self) -> None:
        """Close the file; changes that were not committed are lost."""
        self._disk.close()
        super().close()

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Set the position of the next read or write, and return it."""
        self._place = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._place, os.SEEK_END: self._size}[whence]
        return self._place

    def truncate(self, size: int | None = None) -> int:
        """Set the size of the file [bytes], and return it; None: to the present position."""
        self._size = self._place if size is None else size
        return self._size

    def readinto(self, buffer: Any) -> int:
        """Fill a buffer from the present position, and return its size; bytes beyond the file's end are zeros."""
        view = memoryview(buffer).cast("B")
        for number, start, stop, at in self._spans(len(view)):
            view[at : at + stop - start] = self._page(number)[start:stop]
        return len(view)

    def write(self, data: Any) -> int:
        """Write bytes at the present position, in memory; return their number."""
        view = memoryview(data).cast("B")
        for number, start, stop, at in self._spans(len(view)):
            page = self._pages.setdefault(number, self._page(number))
            page[start:stop] = view[at : at + stop - start]
        self._size = max(self._size, self._place)
        return len(view)

    def _spans(self, length: int) -> list[tuple[int, int, int, int]]:
        """Divide the next `length` bytes into pages, and move the position behind them.

        Returns, for each page, its number, start and stop in the page, and the offset of these bytes in the data.
        """
        spans, at, end = [], 0, self._place + length
        while self._place < end:
            number, start = divmod(self._place, PAGE)
            stop = min(PAGE, start + length - at)
            spans.append((number, start, stop, at))
            at += stop - start
            self._place += stop - start
        return spans

    def _page(self, number: int) -> bytearray:
        """Return the present content of a page; zeros follow the end of the file."""
        found = self._pages.get(number)
        return found or bytearray(os.pread(self._disk.fileno(), PAGE, number * PAGE).ljust(PAGE, b"\0"))

    def commit(self) -> None:
        """Write all changes to the disk; if that fails, restore the file and raise OSError."""
        disk = self._disk.fileno()
        size = os.fstat(disk).st_size
        changed = self._pages.keys() | range(self._size // PAGE, -(-size // PAGE))  # the latter are cut off
        before = {number: os.pread(disk, PAGE, number * PAGE) for number in changed if number * PAGE < size}
        _write_journal(self._path, size, before)
        try:
            _change(self._path, self._size, self._pages)
        except OSError:
            # If this fails as well, the journal stays.
            with contextlib.suppress(OSError):
                roll_back(self._path)
            raise
        journal_of(self._path).unlink()


def journal_of(path: Path) -> Path:
    """Return the path of the journal of a file; it exists only while the file is being changed."""
    return path.with_name(f"{path.name}.journal")


def roll_back(path: Path) -> None:
    """Restore a file from its journal, if there is one, and remove the journal; errors as in `Journaled`."""
    found = read_journal(path)
    if found is not None:
        _change(path, *found)
        journal_of(path).unlink()


def read_journal(path: Path) -> tuple[int, dict[int, bytes]] | None:
    """Return old size [bytes] and old pages, by number, from a file's journal; None without a journal."""
    try:
        content = journal_of(path).read_bytes()
    except FileNotFoundError:
        return None
    body, check = content[:-_NUMBER], int.from_bytes(content[-_NUMBER:], "little")
    if len(content) < 2 * _NUMBER or zlib.crc32(body) != check:
        raise ValueError(f"its journal {journal_of(path).name} is damaged")
    step = _NUMBER + PAGE
    rows = [body[k : k + step] for k in range(_NUMBER, len(body), step)]
    return int.from_bytes(body[:_NUMBER], "little"), {
        int.from_bytes(row[:_NUMBER], "little"): row[_NUMBER:] for row in rows
    }


def _write_journal(path: Path, size: int, pages: Mapping[int, bytes]) -> None:
    rows = [number.to_bytes(_NUMBER, "little") + content.ljust(PAGE, b"\0") for number, content in pages.items()]
    body = b"".join([size.to_bytes(_NUMBER, "little"), *rows])
    with whole(journal_of(path)) as temporary, temporary.open("wb") as file:
        file.write(body + zlib.crc32(body).to_bytes(_NUMBER, "little"))
        file.flush()
        os.fsync(file.fileno())
    # The journal's name must be on the disk before the file changes.
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _change(path: Path, size: int, pages: Mapping[int, bytes | bytearray]) -> None:
    """Write pages, given by number, into a file, and set the size of the file [bytes]."""
    with path.open("r+b") as file:
        for number in sorted(pages):
            file.seek(number * PAGE)
            file.write(pages[number])
        file.truncate(size)
        file.flush()
        os.fsync(file.fileno())
