// What must be there before the page's script runs: STOP's keys, the theme and the language. STOP is a form, so a click needs no
// script at all.

addEventListener("keydown", (event) => {
  const { key, repeat, target } = event;
  // The page's script says so once it listens itself (`stop.js`).
  if (repeat || document.documentElement.dataset.stops) return;
  if (key !== "Escape" && (key !== " " || (target instanceof Element && target.matches("input, select, textarea")))) return;
  event.preventDefault();
  const stop = document.querySelector("#stop");
  if (stop instanceof HTMLButtonElement) stop.form?.requestSubmit(stop);
}, { capture: true });

// The form says who presses, if the person at this browser has chosen a name (`link.js`).
addEventListener("formdata", ({ formData }) => {
  const name = localStorage.getItem("name");
  if (name) formData.set("name", name);
});

// The theme that was chosen (`theme.js`), also where it is chosen in another window.
function useTheme() {
  const { dataset } = document.documentElement;
  const theme = localStorage.getItem("theme");
  if (theme === "light" || theme === "dark") dataset.theme = theme;
  else delete dataset.theme;
}
useTheme();
addEventListener("storage", useTheme);

// The language that was chosen (`words.js`), or else the browser's; English if the page does not know it. Its words come
// while the page's script is on its way.
{
  const root = document.documentElement;
  const language = (localStorage.getItem("language") ?? navigator.language).startsWith("sv") ? "sv" : "en";
  root.lang = root.dataset.language = language;
  const words = document.createElement("link");
  words.rel = "modulepreload";
  words.href = `words/${language}.js`;
  document.head.append(words);
}
