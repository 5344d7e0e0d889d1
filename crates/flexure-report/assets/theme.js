/* Light, dark and paper. The plots read their colours from the style sheet, and redraw when these change. */

const root = document.documentElement;
const systemDark = matchMedia("(prefers-color-scheme: dark)");
const appearanceListeners = [];
let colours = new Map();
let wanted = null; // what the reader chose by the button: "light", "dark", or null for the system's

/** The colour that the style sheet gives to a name, for drawing on a canvas. */
function colour(name) {
  if (!colours.has(name)) colours.set(name, getComputedStyle(root).getPropertyValue(name).trim());
  return colours.get(name);
}

/** Calls `listener` after every change of colours or of the medium. */
function onAppearance(listener) {
  appearanceListeners.push(listener);
}

const isPrinting = () => root.classList.contains("printing");

function applyAppearance({ printing = false } = {}) {
  const dark = !printing && (wanted ? wanted === "dark" : systemDark.matches);
  root.classList.toggle("dark", dark);
  root.classList.toggle("printing", printing);
  colours = new Map();
  for (const listener of appearanceListeners) listener();
}

function startTheme() {
  const button = byId("theme");
  button.addEventListener("click", () => {
    wanted = root.classList.contains("dark") ? "light" : "dark";
    applyAppearance();
  });
  systemDark.addEventListener("change", () => applyAppearance());
  addEventListener("beforeprint", () => applyAppearance({ printing: true }));
  addEventListener("afterprint", () => applyAppearance());
  applyAppearance();
}
