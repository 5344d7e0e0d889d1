"""The curves of model files, and their plots over the true ones."""

import numpy as np
from pictures import BLUE, ORANGE


def curves(model):
    """The static nonlinearities of a model file, in order: arrays x and y."""

    def walk(block):
        kind, content = next(iter(block.items())) if isinstance(block, dict) and len(block) == 1 else (None, block)
        if kind == "static":
            yield np.array(content["x"]), np.array(content["y"])
        elif isinstance(content, dict):
            for part in content.values():
                yield from walk(part)
        elif isinstance(content, list):
            for part in content:
                if isinstance(part, (dict, list)):
                    yield from walk(part)

    return [c for c in walk(model["block"]) if len(c[0])]


def thin(*columns, points=400):
    keep = np.unique(np.linspace(0, len(columns[0]) - 1, points).astype(int))
    return [np.asarray(c)[keep] for c in columns]


def loop_curve(model):
    """x and y of the nonlinearity of a loop."""
    curve = model["block"]["series"][0]["feedback"]["nonlinearity"]
    return np.array(curve["x"]), np.array(curve["y"])


def draw_curve(axes, x, y, truth, labels):
    """The estimate over the truth, which is dashed."""
    axes.plot(*thin(x, y), color=BLUE, label="identified")
    axes.plot(*thin(x, truth), color=ORANGE, dashes=(4, 3), linewidth=1.4, label="in the simulation")
    axes.set(xlabel=labels[0], ylabel=labels[1])
    axes.legend()
