"""Where the arm of flexible-arm.toml is, from its records."""

import numpy as np

LENGTH, SHOULDER, SIDE, ELEMENTS = 4.5, 0.6, 0.6, 3


def turned(angle, places):
    cos, sin = np.cos(angle), np.sin(angle)
    return places @ np.array([[cos, sin], [-sin, cos]])


def axis(record, name, k):
    """Places along a beam of cubic elements in its own frame, shortened by its slopes, and the slope at its tip."""
    nodes = np.array([0.0, 0.0] + [record[f"e{i}_{name}"][k] for i in range(1, 2 * ELEMENTS + 1)]).reshape(-1, 2)
    x, h = np.linspace(0, 1, 21)[:, None], 1 / ELEMENTS
    (w0, s0), (w1, s1) = nodes[:-1].T, nodes[1:].T
    w = (1 - x) ** 2 * (1 + 2 * x) * w0 + h * x * (1 - x) ** 2 * s0 + x**2 * (3 - 2 * x) * w1 - h * x**2 * (1 - x) * s1
    w = np.append(w[:-1].T.ravel(), w[-1, -1])
    step = LENGTH / (len(w) - 1)
    along = np.concatenate([[0.0], np.cumsum(step - 0.5 * np.diff(w) ** 2 / step)])
    return np.column_stack([along, w]), nodes[-1, 1] / LENGTH


def places(record, k):
    """The outline of the base and of both links at an instant."""
    origin, angle = np.array([record["base_x"][k], record["base_y"][k]]), record["base_angle"][k]
    corners = SIDE * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    base, root = origin + turned(angle, corners), origin + turned(angle, np.array([SHOULDER, 0.0]))
    links = []
    for name, joint in [("upper", "shoulder"), ("lower", "elbow")]:
        angle = angle + record[f"q_{joint}"][k]
        own, slope = axis(record, name, k)
        links.append(root + turned(angle, own))
        root, angle = links[-1][-1], angle + slope
    return base, links


def segmented_tip(record, name):
    """What the tip of a beam of segments with springs at their roots deflects, m."""
    bends = np.cumsum([v for key, v in record.items() if key.startswith(f"q_{name}_bend")], axis=0)
    return LENGTH / len(bends) * np.sin(bends).sum(axis=0)
