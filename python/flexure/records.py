"""Records from files: ROS 2 bags (MCAP, ``.db3``), HDF5, MAT, Parquet and text, read as the command line reads them.

What was decided, such as which topic was read, is logged at level INFO by the logger ``flexure.records``.
"""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Sequence
from typing import Literal

import numpy as np
import numpy.typing as npt

from flexure import _core
from flexure._core import FileError, ParameterError

__all__ = ["read"]

_log = logging.getLogger(__name__)

_SEPARATORS = {None: None, "comma": ",", "semicolon": ";", "tab": "\t", "pipe": "|", "space": " "}


def read(
    path: str | os.PathLike[str],
    *,
    topic: str | None = None,
    joint: str | None = None,
    separator: Literal["comma", "semicolon", "tab", "pipe", "space"] | None = None,
    decimal: Literal["point", "comma"] | None = None,
    header: bool | None = None,
    skip_lines: int = 0,
    time_format: str | None = None,
    missing_text: str | Sequence[str] = (),
    memory: int | None = None,
) -> dict[str, npt.NDArray[np.float64]]:
    """The columns of a record by their names, as ``fit`` and the functions of `flexure.prepare` take them. A missing sample is NaN.

    The column ``t`` of a bag counts the seconds from the first stamp.

    Parameters
    ----------
    path:
        The file. A bag or an HDF5 file may be packed by Zstandard or gzip.
    topic:
        The topic of a bag, which need not be given where only one has numbers, or the joint; the group of an HDF5 file. The error
        without it lists the topics.
    joint:
        The joint of a topic of ``sensor_msgs/JointState``: the columns are ``position``, ``velocity`` and ``effort``. By default all
        joints, each with its name before that.
    separator, decimal, header, skip_lines, time_format, missing_text:
        How a text file is read, where it leaves that open: what is between two fields, the decimal sign, whether the first line
        has the names, lines to leave out before the table, the format of time stamps that are not ISO 8601, texts that stand for a missing sample.
    memory:
        The most memory that the record may take, bytes; by default 4 GiB, or a twentieth of the free memory where that is less.

    Raises
    ------
    FileError
        What is wrong in the file, and where.

    Examples
    --------
    >>> import flexure
    >>> log = flexure.read("log.mcap", joint="elbow")  # doctest: +SKIP
    >>> joint = flexure.identify_joint(log["effort"], log["position"], dt=0.005)  # doctest: +SKIP
    """
    if separator not in _SEPARATORS:
        raise ParameterError(f"separator is {separator!r}, but must be comma, semicolon, tab, pipe or space")
    missing = [missing_text] if isinstance(missing_text, str) else list(missing_text)
    text = (_SEPARATORS[separator], decimal, header, skip_lines, time_format, missing)
    try:
        columns, notes = _core.read_record(path, topic, joint, *text, memory)
    except FileError as error:
        raise FileError(_as_arguments(str(error))) from None
    for note in notes:
        _log.info("%s: %s", os.fspath(path), note)
    return columns


def _as_arguments(message: str) -> str:
    """What the command line calls options are arguments here."""
    message = message.replace("--memory SIZE (such as 8GiB)", "memory=BYTES")

    def argument(found: re.Match[str]) -> str:
        name, value = found[1].replace("-", "_"), found[2] or ""
        words = {"yes": "True", "no": "False", "comma": "'comma'", "point": "'point'"}
        return f"{name}={words.get(value, value)}"

    return re.sub(r"--([a-z]+(?:-[a-z]+)*)(?: (comma\b|point\b|yes\b|no\b|N\b|\d+\b|'[^']*'))?", argument, message)
