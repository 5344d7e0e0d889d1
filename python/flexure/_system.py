"""What all identified systems have in common."""

from __future__ import annotations

import json
from collections.abc import Sequence
from html import escape
from os import PathLike
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator
from sklearn.exceptions import NotFittedError

from flexure import _records as records
from flexure._arrays import whole
from flexure._core import FlexureError, Identification, Model, ParameterError, structures
from flexure._files import blocks_of
from flexure._html import html
from flexure._options import KINDS, OPTIONS, points
from flexure.results import Block, Branch, Comparison, FormTest, LinearPart, Verdict, block_of, frame

Array = npt.NDArray[np.float64]


def _joined(parts: list[Array]) -> Array:
    """The samples of all experiments, one after the other."""
    return parts[0] if len(parts) == 1 else np.concatenate(parts)


class System(BaseEstimator):  # type: ignore[misc]
    """What all identified systems have in common.

    Attributes
    ----------
    nonlinearity_, linear_, front_, back_, output_nonlinearity_ : Nonlinearity, Surface or LinearPart
        The blocks that the structure has.
    branches_ : list of Branch
        Of a structure with several cascades side by side.
    structure_ : str
        The structure's name.
    verdict_ : Verdict
        Whether the model holds on the samples that were not fitted.
    order_, delay_ : int
        Of all linear parts together, in poles and samples.
    dt_ : float or None
        The sample time, s.
    output_offset_ : float
        Added to the last linear part's output.
    warnings_ : list of str
        What to know before trusting it.
    predicted_ : array of shape (n,)
        The free run over the record; None of a model out of a file.
    comparison_ : Comparison or None
        Of `Auto`: the structures that were compared.
    fitted_ : int
        The samples of the record that were fitted; the others are fresh.
    result_ : dict
        Everything that was found, as ``flexure identify --json`` prints it.
    """

    _structure: ClassVar[str] = ""

    def __init__(self, *, fresh: float = 0.25, robust: bool = False, missing: bool = False) -> None:
        self.fresh = fresh
        self.robust = robust
        self.missing = missing

    def fit(
        self,
        u: Any,
        y: Any = None,
        *,
        dt: float | None = None,
        input: str | Sequence[str] | None = None,
        output: str | None = None,
    ) -> Self:
        """Identifies the system from input and output.

        Parameters
        ----------
        u, y : array of shape (n,)
            Input and output, one value a sample, any real dtype and layout; series keep their names, and a time index tells
            the sample time. Or `u` alone: a table (pandas, polars, xarray, a dict, python-control's response) with the columns
            that `input` and `output` name. Lists of either are several experiments (Hammerstein's refined method). Models of
            several inputs (`MultipleInputs`, `JointInputs`) take them as an array of shape (n, m) or as a table.
        dt : float, optional
            The sample time, s.
        input, output : str, optional
            The names of the columns, or of the signals; a list of names for several inputs.

        Raises
        ------
        DataError
            Samples that are not finite or do not vary, lengths or times that do not fit.
        TooShortError
            Too few samples.
        ParameterError
            A parameter outside its range.
        KeyboardInterrupt
            On Ctrl-C. The work has then ended.
        """
        row = next(row for row in structures() if row.name == self._structure)
        several = row.several_inputs and (not row.single_input or records.has_several_inputs(u, input))
        if records.is_several(u) and not several:
            outputs = [None] * len(u) if y is None else list(y)
            if len(outputs) != len(u):
                raise ParameterError(f"there are {len(u)} inputs, but {len(outputs)} outputs")
            parts = [records.signals(a, b, dt, input, output) for a, b in zip(u, outputs, strict=True)]
        else:
            parts = [records.signals(u, y, dt, input, output, several)]
        if len({part.dt for part in parts}) > 1:
            raise ParameterError("the experiments have different sample times")
        first = parts[0]
        joined = [_joined(list(columns)) for columns in zip(*([*part.u, part.y] for part in parts), strict=True)]
        samples = [len(part.y) for part in parts] if len(parts) > 1 else None
        inputs = list(zip(first.inputs, joined, strict=False))
        identification = Identification(inputs, (first.output, joined[-1]), first.dt, self._options(), samples)
        return self._identified(identification, joined[:-1], joined[-1])

    def _identified(self, identification: Identification, inputs: list[Array], output: Array) -> Self:
        """Takes what was identified, and the record that it is judged on."""
        self._identification = identification
        self._record = (inputs, output)
        self.predicted_: Array | None = identification.predicted()
        self._take(identification.model(), json.loads(identification.json()))
        return self

    def _options(self) -> dict[str, Any]:
        """The options for the library."""
        options = {**OPTIONS, "structure": self._structure, **self.get_params()}
        for name, kind, allowed in KINDS:
            value = options[name]
            if value is None and OPTIONS[name] is None:
                continue
            if kind is int:
                options[name] = whole(value, name)
            elif not isinstance(value, kind):
                raise ParameterError(f"{name} is {value!r}, but must be {allowed}")
        if options["known"] is not None:
            options["known"] = points(options["known"])
        return options

    def _take(self, model: Model, result: dict[str, Any]) -> None:
        """Sets what was found as attributes."""
        for name in [*getattr(self, "_named", ()), "branches"]:  # those of a fit before, which may have had another structure
            self.__dict__.pop(f"{name}_", None)
        self._model = model
        file = json.loads(model.json())
        self.result_ = result
        self.structure_ = str(result["structure"])
        self.dt_ = result["sample_time"]
        self.inputs_ = tuple(model.inputs)
        self.input_, self.output_ = ", ".join(self.inputs_), result["output"]
        self.order_, self.delay_ = file["order"], file["delay"]
        self.output_offset_ = result.get("output_offset", 0.0)
        self.verdict_ = Verdict.of(result)
        self.warnings_ = list(result["warnings"])
        self.fitted_ = result["samples_fitted"]
        self.comparison_ = Comparison.of(result["comparison"]) if result.get("comparison") else None
        roles = [[label["role"] for label in path["blocks"]] for path in file["paths"]]
        if file["is_sum"]:
            found = zip(roles, result["branches"], strict=True)
            self.branches_ = [Branch.of(self._blocks(own, branch), branch["input"]) for own, branch in found]
            self._named: list[str] = []
        else:
            blocks = self._blocks(roles[0] if roles else [], result)
            self._named = [name for name, _ in blocks]
            for name, block in blocks:
                setattr(self, f"{name}_", block)

    def _blocks(self, roles: list[str], found: dict[str, Any]) -> list[tuple[str, Block]]:
        """The blocks of these roles that act at the samples."""
        breaks = self.result_.get("breakpoints") or ()
        blocks = [(role, block_of(found.get(role), self.dt_, breaks)) for role in roles if not role.startswith("intersample_")]
        return [(role, block) for role, block in blocks if block is not None]

    @property
    def form_(self) -> FormTest | None:
        """The physical form that was asked for, else one that suffices, and its test; None where there is none."""
        self._fitted()
        found = self.result_.get("form")
        return None if found is None else FormTest.of(found)

    @property
    def paths_(self) -> list[tuple[str, list[tuple[str, Block]]]]:
        """What enters each cascade of blocks, and the blocks with their names in the signal's order; the cascades' outputs add up."""
        self._fitted()
        if hasattr(self, "branches_"):
            return [(branch.input or self.input_, list(branch.blocks)) for branch in self.branches_]
        return [(self.input_, [(name, getattr(self, f"{name}_")) for name in self._named])]

    @property
    def blocks_(self) -> list[tuple[str, Block]]:
        """The blocks with their names, in the signal's order; those of several cascades one after the other, numbered."""
        paths = self.paths_
        if len(paths) == 1:
            return paths[0][1]
        return [(f"{name}_{i + 1}", block) for i, (_, blocks) in enumerate(paths) for name, block in blocks]

    def simulate(self, u: Any) -> Array:
        """The free run: the output under the input alone, from the steady state that belongs to the first input.

        Parameters
        ----------
        u : array of shape (n,), or (n, m) for m inputs
            The input, one value a sample; or a table with the columns that were fitted.

        Returns
        -------
        array of shape (n,)
            In the unit of the output.
        """
        model = self._fitted()
        return model.simulate(records.input_signals(u, self.inputs_, self._several_inputs, self.dt_))

    def predict(self, u: Any, y: Any = None, horizon: int = 1) -> Array:
        """The output predicted `horizon` samples ahead: every value uses the outputs up to `horizon` samples before it.

        Parameters
        ----------
        u, y : array of shape (n,); u of shape (n, m) for m inputs
            Input and measured output; or a table with the columns that were fitted.
        horizon : int
            At least 1. Only a noise model (``Hammerstein``) makes a difference to the free run.

        Returns
        -------
        array of shape (n,)
            In the unit of the output. The state at the start is the one that fits best.
        """
        horizon = whole(horizon, "horizon", 1)
        model, given = self._fitted(), self._signals(u, y)
        return model.predict(given.u, given.y, horizon)

    def validate(self, u: Any, y: Any = None, *, skip: int | None = None) -> Verdict:
        """Judges the model on a record that was not used for its fit.

        `skip` samples at the start do not count, by default those that the model takes to settle, at most a tenth.
        """
        model, given = self._fitted(), self._signals(u, y)
        skip = None if skip is None else whole(skip, "skip")
        if skip is not None and skip >= len(given.y):
            raise ParameterError(f"skip is {skip}, which leaves nothing of {len(given.y)} samples to compare")
        return Verdict.of(json.loads(model.validate(given.u, given.y, skip)))

    def score(self, u: Any, y: Any = None) -> float:
        """The free run's R², ``1 - |y - yh|² / |y - mean y|²``, on this record; at best 1."""
        return self.validate(u, y).r_squared

    @property
    def _several_inputs(self) -> bool:
        return len(self.inputs_) > 1

    def _signals(self, u: Any, y: Any) -> records.Signals:
        several = self._several_inputs
        names: Any = list(self.inputs_) if several else self.input_
        if y is None:
            given = records.signals(u, None, None, names, self.output_, several)
        else:
            columns = records.input_signals(u, self.inputs_, several, self.dt_)
            records.check_same_times(u, y, self.output_)
            given = records.signals(np.column_stack(columns) if several else columns[0], y, None, names, self.output_, several)
        records.check_sampled_as(self.dt_, given.dt)
        return given

    def summary(self) -> str:
        """The text that ``flexure identify`` prints."""
        return self._session("summary").summary()

    def report(self, path: str | PathLike[str]) -> None:
        """Writes the page that ``flexure identify --report`` writes: one HTML file that needs no network."""
        page = self._session("report").page()
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)

    def to_control(self, form: str = "tf") -> Any:
        """The linear part as python-control's ``TransferFunction`` (``form="tf"``) or ``StateSpace`` (``form="ss"``).

        Of a structure with several linear parts, all by name in a dict.
        """
        parts = {name: b.to_control(form) for name, b in self.blocks_ if isinstance(b, LinearPart)}
        if not parts:
            raise FlexureError(f"a {self.structure_} model has no linear part")
        return parts if len(parts) > 1 else next(iter(parts.values()))

    def to_frame(self, library: str = "pandas") -> Any:
        """The record and the free run over it, as a frame of "pandas" or "polars".

        Columns: ``t`` (s, where the sample time is known), inputs and output by their names, ``simulated``, ``residual``, and
        ``fresh`` for the samples that were not fitted.
        """
        self._session("to_frame")
        inputs, y = self._record
        time = {} if self.dt_ is None else {"t": np.arange(len(y)) * self.dt_}
        columns = {
            **time,
            **dict(zip(self.inputs_, inputs, strict=True)),
            self.output_: y,
            "simulated": self.predicted_,
            "residual": y - np.asarray(self.predicted_),
            "fresh": np.arange(len(y)) >= self.fitted_,
        }
        return frame(columns, library)

    def plot(self, *, truth: Any = None) -> Any:
        """Everything in one matplotlib figure: blocks, fresh data against the free run, and the residual's tests.

        `truth(x)`, if it is known, is drawn dashed together with the nonlinearity. `flexure.plots` has the parts.
        """
        self._fitted()
        from flexure import plots

        return plots.system(self, truth=truth)

    def __repr__(self, N_CHAR_MAX: int = 700) -> str:
        """The parameters, as scikit-learn shows them; of a fitted model what was found."""
        if not self.__sklearn_is_fitted__():
            return str(super().__repr__(N_CHAR_MAX))
        name = type(self).__name__
        if self._structure == "auto":
            name += f" ({self.structure_})"
        found = f"order {self.order_}, delay {self.delay_}; fit {self.verdict_.fit_percent:.2f} % on fresh samples"
        return f"<{name} from {self.input_} to {self.output_}: {found}, {'holds' if self.verdict_.holds else 'does not hold'}>"

    def _repr_html_(self) -> str:
        """The blocks as a drawing, for notebooks."""
        if not self.__sklearn_is_fitted__():
            return f"<pre>{escape(repr(self))}</pre>"
        return html(self)

    def _repr_mimebundle_(self, **_: Any) -> dict[str, str]:
        """What notebooks ask for first, where scikit-learn has its own drawing."""
        return {"text/plain": repr(self), "text/html": self._repr_html_()}

    def _session(self, what: str) -> Identification:
        self._fitted()
        if getattr(self, "_identification", None) is None:
            raise FlexureError(f"{what} needs the record, which a model out of a file or a pickle does not have; fit it again")
        return self._identification

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the model file that ``flexure identify -o`` writes."""
        self._fitted().write(path)

    def export(
        self, to: str, path: str | PathLike[str], *, name: str | None = None, fmi: int = 2, compile: bool = False
    ) -> list[Path]:
        """Writes the model as code for other programs, as ``flexure export`` does; returns the files.

        Parameters
        ----------
        to : {"c", "fmu", "onnx", "python", "matlab"}
            The format.
        path : path
            The file, with the extension of the format, or a folder. C has a header file in addition.
        name : str, optional
            The name of the functions, the class or the FMU: an identifier. None: the name of the file.
        fmi : {2, 3}
            The version of an FMU.
        compile : bool
            Whether an FMU has a library for this machine, made by the local C compiler.
        """
        return self._fitted().export(to, path, name, str(fmi), compile)

    def to_json(self) -> str:
        """The text of the model file."""
        return self._fitted().json()

    def to_dict(self) -> dict[str, Any]:
        """The model file as a dict."""
        return dict(json.loads(self.to_json()))

    @classmethod
    def from_json(cls, text: str) -> Self:
        """The model out of the text of a model file, such as ``flexure identify -o`` writes."""
        return cls._of(Model.from_json(text))

    @classmethod
    def from_dict(cls, model: dict[str, Any]) -> Self:
        """The model out of what `to_dict` made."""
        return cls.from_json(json.dumps(model))

    @classmethod
    def _of(cls, model: Model) -> Self:
        file = json.loads(model.json())
        file["input"] = ",".join(file["inputs"])
        if cls._structure not in (file["structure"], "auto"):
            raise FlexureError(f"the model's structure is {file['structure']}, not {cls._structure}; take flexure.load")
        self = cls()
        result = {**file["identification"], **blocks_of(file)}
        self.predicted_ = None
        self._take(model, {k: v for k, v in {**file, **result}.items() if k not in ("block", "identification")})
        return self

    def _fitted(self) -> Model:
        model: Model | None = getattr(self, "_model", None)
        if model is None:
            raise NotFittedError(f"this {type(self).__name__} is not fitted yet; call fit first")
        return model

    def __sklearn_is_fitted__(self) -> bool:
        return hasattr(self, "_model")

    def __getstate__(self) -> dict[str, Any]:
        state = dict(super().__getstate__())
        if "_model" in state:
            state["_model"] = self._model.json()
        state["_identification"] = None
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        super().__setstate__(state)
        if isinstance(self.__dict__.get("_model"), str):
            self._model = Model.from_json(self.__dict__["_model"])
