const ANEW = "The class has started anew: scan the code again.";
let mine = null, asked = "", moved = false;
const SEAT = "himpc-lab-seat " + location.pathname;

function stored() {
  try { return sessionStorage.getItem(SEAT) || localStorage.getItem(SEAT) || ""; } catch { return ""; }
}

function keep(seat) {
  try { localStorage.setItem(SEAT, seat); } catch { /* a browser that cannot store the seat gets a new one */ }
}

function figure(value) {
  return value >= 100 ? value.toFixed(0) : String(Number(value.toPrecision(3)));
}

function guess() {
  const { low, high } = news.all.asked.scale;
  return low * Math.pow(high / low, Number(ID("scale").value) / 200);
}

function write(told) {
  const all = news.all;
  if ("wait" in told) setTimeout(hello, 1000 * told.wait);
  if (!all) return;
  if ("seat" in told) keep(told.seat);
  if ("mine" in told) mine = told.mine;
  if ("name" in told && document.activeElement !== ID("name")) ID("name").value = told.name;
  const key = JSON.stringify([all.title, all.asked, all.round]);
  if (key !== asked) {
    if (asked) { mine = "mine" in told ? told.mine : null; say(""); }
    asked = key;
    moved = false;
    build(all);
  }
  const open = all.stage === "open";
  put("title", all.title || "himpc-lab");
  ID("stage").textContent = {
    waiting: all.title ? "Watch; the vote is not open yet." : "",
    open: all.round > 1 ? "Second vote: talk first, then answer again." : "Vote now.",
    closed: "The vote is closed.",
    running: "The robot runs.",
    decided: "",
  }[all.stage];
  for (const button of ID("answers").children) {
    button.disabled = !open;
    button.setAttribute("aria-pressed", String(Number(button.value) === mine));
    button.lastChild.textContent = Number(button.value) === mine ? "✓" : "";
  }
  show("answers", open && all.asked && all.asked.options);
  show("number", open && all.asked && all.asked.scale);
  ID("mine").textContent = mine === null || !all.asked ? "" : all.asked.options
    ? `You said ${"ABCDEFG"[mine]}.` : `You said ${figure(mine)} ${all.asked.scale.unit}.`;
  if (!open && all.round) say("");
  put("bars", open ? "" : bars(all.rounds));
  spread();
  ID("result").textContent = all.result;
  show("who", all.named);
}

function build(all) {
  put("question", all.asked ? all.asked.question : all.title ? "Watch the robot." : "Wait for your teacher to choose a step.");
  ID("answers").shown = null;
  put("answers", !all.asked || !all.asked.options ? "" : all.asked.options.map((option, k) =>
    `<button type="button" value="${k}"><b>${"ABCDEFG"[k]}</b><span>${option}</span><span></span></button>`).join(""));
  ID("scale").value = 100;
  tell();
}

function tell() {
  if (!news.all.asked || !news.all.asked.scale) return;
  const text = `${figure(guess())} ${news.all.asked.scale.unit}`;
  ID("guess").textContent = text;
  ID("scale").setAttribute("aria-valuetext", text);
}

ID("answers").addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button) send({ do: "vote", answer: Number(button.value) });
});
ID("scale").addEventListener("input", tell);
ID("number").addEventListener("submit", (event) => {
  event.preventDefault();
  send({ do: "vote", answer: guess() });
});
ID("who").addEventListener("submit", (event) => {
  event.preventDefault();
  send({ do: "name", name: ID("name").value });
  ID("name").blur();
});
function hello() {
  send({ do: "hello", seat: stored() });
}

connect(hello, write);
