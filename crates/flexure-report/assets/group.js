/* Plots with one common abscissa: zooming or pointing in one does so in all, and buttons do it without a mouse. */

class Group {
  /** `full` is the whole range of the abscissa, `step` the distance of its points. */
  constructor(key, full, step) {
    this.key = key;
    this.full = full;
    this.least = Math.min(8 * step, full[1] - full[0]);
    this.plots = [];
    this.listeners = [];
    this.window = full;
    this.side = 0;
    this.beside = new Set();
  }

  /** The width of the labels beside all these plots, after plot `u` has asked for `need` px. */
  widen(need, u) {
    this.beside.add(u);
    if (need > this.side) {
      this.side = need;
      queueMicrotask(() => this.beside.forEach((other) => other !== u && other.status && other.redraw(false, true)));
    }
    return this.side;
  }

  add(u) {
    this.plots.push(u);
  }

  /** Calls `listener` with the window after each change. */
  onWindow(listener) {
    this.listeners.push(listener);
  }

  /** Takes over the window of the plot that the reader zoomed. */
  follow(u) {
    const { min, max } = u.scales.x;
    if (min == null || (min === this.window[0] && max === this.window[1])) return;
    this.show(min, max);
  }

  /** Shows the window, kept inside the whole range and not narrower than a few points. */
  show(min, max) {
    const [start, end] = this.full;
    const span = Math.min(Math.max(max - min, this.least), end - start);
    const low = Math.min(Math.max(max - min < span ? (min + max - span) / 2 : min, start), end - span);
    this.window = [low, low + span];
    for (const u of this.plots) u.setScale("x", { min: this.window[0], max: this.window[1] });
    for (const listener of this.listeners) listener(this.window);
  }

  zoom(factor) {
    const [min, max] = this.window;
    const [middle, half] = [(min + max) / 2, ((max - min) / 2) * factor];
    this.show(middle - half, middle + half);
  }

  pan(part) {
    const [min, max] = this.window;
    const shift = (max - min) * part;
    this.show(min + shift, max + shift);
  }

  reset() {
    this.show(...this.full);
  }

  /** Fills `host` with buttons that zoom and pan. */
  buttons(host) {
    const actions = [
      ["left", "‹", "Earlier", () => this.pan(-0.5)],
      ["right", "›", "Later", () => this.pan(0.5)],
      ["in", "+", "Zoom in", () => this.zoom(0.5)],
      ["out", "−", "Zoom out", () => this.zoom(2)],
      ["reset", "Show all", "Show everything", () => this.reset()],
    ];
    host.setAttribute("role", "toolbar");
    host.setAttribute("aria-label", "Zoom");
    const made = actions.map(([name, sign, text, act]) => {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: sign, title: text, onclick: act });
      button.dataset.zoom = name;
      button.setAttribute("aria-label", text);
      return button;
    });
    host.append(...made);
    const enable = ([min, max]) => {
      const [start, end] = this.full;
      const tiny = (end - start) * 1e-9;
      const still = [min <= start + tiny, max >= end - tiny];
      [still[0], still[1], max - min <= this.least * 1.001, still[0] && still[1], still[0] && still[1]].forEach((off, i) => {
        made[i].disabled = off;
      });
    };
    this.onWindow(enable);
    enable(this.window);
  }
}

/** The group of an evenly spaced grid. */
function gridGroup(key, grid) {
  return new Group(key, [grid.start, grid.start + Math.max(grid.count - 1, 1) * grid.step], grid.step);
}
