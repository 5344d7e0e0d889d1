"""Records from files: ROS 2 bags (MCAP, ``.db3``), HDF5, MAT, Parquet and text, read as the command line reads them.

What was decided, such as which topic was read, is logged at level INFO by the logger ``flexure.records``.
"""

from __future__ import annotations

import logging
import os
import re
from typing import Literal

import numpy as np
import numpy.typing as npt

from flexure import _core
from flexure._core import FileError

__all__ = ["read"]

_log = logging.getLogger(__name__)


def read(
    path: str | os.PathLike[str],
    *,
    topic: str | None = None,
    joint: str | None = None,
    separator: str | None = None,
    decimal: Literal["point", "comma"] | None = None,
    header: bool | None = None,
    skip_lines: int = 0,
    time_format: str | None = None,
) -> dict[str, npt.NDArray[np.float64]]:
    """The columns of a record by their names, as ``fit`` and the functions of `flexure.prepare` take them. A missing sample is NaN.

    The column ``t`` of a bag counts the seconds from the first stamp.

    Parameters
    ----------
    path:
        The file. A bag or an HDF5 file may be packed by Zstandard.
    topic:
        The topic of a bag, which need not be given where only one has numbers, or the joint; the group of an HDF5 file. The error
        without it lists the topics.
    joint:
        The joint of a topic of ``sensor_msgs/JointState``: the columns are ``position``, ``velocity`` and ``effort``. By default all
        joints, each with its name before that.
    separator, decimal, header, skip_lines, time_format:
        How a text file is read, where it leaves that open: the character between two fields, the decimal sign, whether the first line
        has the names, lines to leave out before the table, the format of time stamps that are not ISO 8601.

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
    try:
        columns, notes = _core.read_record(path, topic, joint, separator, decimal, header, skip_lines, time_format)
    except FileError as error:
        # The options of the command line are arguments here.
        raise FileError(re.sub(r"--([a-z]+)(?:-([a-z]+))?", lambda m: "_".join(filter(None, m.groups())) + "=", str(error))) from None
    for note in notes:
        _log.info("%s: %s", os.fspath(path), note)
    return columns
