// A film is loaded on a click: the player and the scene are files in a folder beside the pages.
document.addEventListener("click", (event) => {
  const button = event.target instanceof Element ? event.target.closest("button[data-film]") : null;
  if (!button) return;
  const theme = document.body.dataset.theme;
  const dark = theme === "dark" || (theme !== "light" && matchMedia("(prefers-color-scheme: dark)").matches);
  const frame = document.createElement("iframe");
  frame.src = button.dataset.film + (dark ? ",dark" : "");
  frame.title = button.title;
  button.replaceWith(frame);
});
