// Live figures are loaded on a click. They are scripts in a folder beside the pages: a page that is opened
// from a disk may load scripts, but no other files.
const himpcScripts = {};
function himpcScript(address) {
  return himpcScripts[address] ??= new Promise((done, fail) => {
    const made = Object.assign(document.createElement("script"), { src: address, onload: done });
    made.onerror = () => fail(new Error(`the file ${address} was not found`));
    document.head.append(made);
  });
}
const himpcLoad = (root, names) => Promise.all(["live", ...names].map((name) => himpcScript(`${root}live/${name}.js`)));

async function himpcFigure(place, { root, pack, file, robot, step, assignments, wide }) {
  if (typeof WebAssembly !== "object" || typeof DecompressionStream !== "function")
    throw new Error("this browser has no WebAssembly or cannot decompress; the recording shows the same run");
  const loaded = himpcLoad(root, ["mujoco", "kernel"]);
  await himpcLoad(root, [`robot-${robot}`, file]);
  return HIMPC.open(place, { pack, robot, step, assignments, wide, loaded, running: wide && !HIMPC.calm() });
}

document.addEventListener("click", (event) => {
  const button = event.target instanceof Element ? event.target.closest("button[data-live]") : null;
  if (button) himpcStep(button, []);
});
async function himpcStep(button, assignments) {
  const [file, step, robot] = button.dataset.live.split("/"), figure = button.closest("figure");
  const place = Object.assign(document.createElement("div"), { textContent: "Loading: the controller and MuJoCo, about 2 MB …" });
  // Only one figure runs at a time: a figure that was open before is replaced by its button.
  for (const other of document.querySelectorAll("figure.live.open")) other.replaceChildren(...other.himpcBefore), other.classList.remove("open");
  figure.himpcBefore = [...figure.childNodes];
  figure.classList.add("open");
  figure.replaceChildren(place);
  try {
    await himpcFigure(place, { root: button.dataset.root, pack: `lesson/${file}`, file, robot, step, assignments, wide: false });
  } catch (error) {
    figure.classList.remove("open");
    figure.replaceChildren(...figure.himpcBefore, Object.assign(document.createElement("p"), { textContent: `This did not work: ${error.message}.` }));
  }
}
// A link with the code of a step opens the figure of this step.
document.addEventListener("DOMContentLoaded", async () => {
  const code = location.hash.slice(1), first = document.querySelector("button[data-live]");
  if (!code.startsWith("hl") || !first) return;
  await himpcLoad(first.dataset.root, []);
  const state = await HIMPC.decode(code);
  const button = state && document.querySelector(`button[data-live^="${first.dataset.live.split("/")[0]}/${Number(state.p)}/"]`);
  if (!button || state.l !== button.dataset.live.split("/")[0]) return;
  button.scrollIntoView();
  const own = JSON.parse(button.dataset.set);
  himpcStep(button, (state.a ?? []).filter((each) => !own.includes(each)));
});
