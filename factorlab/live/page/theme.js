// Light or dark: as the system is set, until the reader chooses.

function show(theme) {
  document.documentElement.dataset.theme = theme;
  try { localStorage.setItem("theme", theme); } catch { /* a private window keeps nothing */ }
}

export function watchTheme(button) {
  let kept = null;
  try { kept = localStorage.getItem("theme"); } catch { /* as above */ }
  show(kept ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light"));
  button.addEventListener("click", () => show(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
}
