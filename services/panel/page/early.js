// Until the page's script runs, Esc and Space press STOP. It is a form, so a click needs no script at all.

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
