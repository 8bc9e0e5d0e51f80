const ANEW = "The class has started anew: open the teacher's address that himpc-lab printed, and scan the code again.";
let course = [], chosen = "";

function fill(select, entries) {
  select.replaceChildren(...entries.map(([value, text]) => {
    const each = document.createElement("option");
    each.value = value;
    each.textContent = text;
    return each;
  }));
}

function steps() {
  const lesson = course.find((each) => each.name === ID("lesson").value);
  fill(ID("step"), (lesson ? lesson.steps : []).map((step, k) =>
    [String(k), `${step.title}${step.asks ? ` (asks for a ${step.asks})` : ""}`]));
}

function write(told) {
  if (told.course) {
    course = told.course;
    const before = ID("lesson").value;
    fill(ID("lesson"), course.map((each) => [each.name, each.title]));
    if (before) ID("lesson").value = before;
    steps();
    if (!before) follow(told.first);
  }
  if (told.address) {
    put("qr", told.address.qr);
    ID("note").textContent = told.address.note;
    const [place, code] = told.address.text.replace(/^https?:\/\//, "").split(/(?=\/v\/)/);
    const big = document.createElement("b");
    big.textContent = code;
    ID("address").replaceChildren(place, big);
  }
  if (told.code) ID("code").textContent = `State of learner ${told.of}, now on your robot: ${told.code}`;
  if (news.pose) ID("clock").textContent = `t = ${news.pose.t.toFixed(1)} s.`;
  const all = news.all, mine = news.class;
  if (!all || !mine) return;
  follow(mine.place);
  const open = all.stage === "open";
  put("title", all.title);
  put("question", all.asked ? all.asked.question : all.title ? "This step has no question: run it." : "Choose a lesson and a step.");
  const options = all.asked && all.asked.options && !(all.rounds.length && !open);
  put("options", !options ? "" : all.asked.options.map((text, k) => `<li><b>${"ABCDEFG"[k]}</b>${text}</li>`).join(""));
  ID("stage").textContent = {
    waiting: "",
    open: `${all.round > 1 ? "Second vote" : "Vote"}: ${all.voted} answered`,
    closed: `${all.voted} answered. Talk about it; then vote again, or run.`,
    running: "The robot runs …",
    decided: mine.shown[1] ? `${mine.shown[0]} of ${mine.shown[1]} claims of this step hold.` : "",
  }[all.stage];
  put("bars", open ? "" : bars(all.rounds));
  spread();
  ID("result").textContent = all.result;
  ID("open").textContent = all.round ? "Open the second vote" : "Open the vote";
  ID("open").disabled = !all.asked || open || all.round > 1 || all.stage === "running" || all.stage === "decided";
  ID("close").disabled = !open;
  ID("run").disabled = !all.title || all.stage === "running";
  main({ waiting: all.asked ? "open" : all.title ? "run" : "go", open: "close", closed: "run", running: "", decided: "go" }[all.stage]);
  const robots = mine.rows.filter((row) => row.here).length;
  ID("present").textContent = `${mine.phones} phone${mine.phones === 1 ? "" : "s"}, ${robots} with a robot`;
  ID("everywhere").checked = mine.everywhere;
  ID("stays").checked = mine.stays;
  people(mine.rows, all.named);
}

function main(name) {
  for (const each of ["go", "open", "close", "run"]) ID(each).classList.toggle("main", each === name);
}

// The lists change only when the class goes to another step: meanwhile the teacher can choose freely.
function follow(place) {
  const key = JSON.stringify(place);
  if (key === chosen || !place) return;
  chosen = key;
  ID("lesson").value = place[0];
  steps();
  ID("step").value = String(place[1]);
}

function people(rows, named) {
  show("named", named);
  const table = ID("rows");
  while (table.rows.length > rows.length) table.deleteRow(-1);
  rows.forEach((row, k) => {
    const line = table.rows[k] || table.insertRow();
    line.className = row.here ? "" : "gone";
    const cells = [row.number, ...(named ? [row.name || "–"] : []), row.at || "–", row.done,
      row.claims ? `${row.met} of ${row.claims}` : "–", row.vote || "–", row.here ? ago(row.quiet) : "left"];
    while (line.cells.length < cells.length + 1) line.insertCell();
    while (line.cells.length > cells.length + 1) line.deleteCell(-1);
    cells.forEach((text, at) => {
      if (line.cells[at].textContent !== String(text)) line.cells[at].textContent = text;
    });
    const last = line.cells[cells.length];
    if (!last.firstChild) last.append(document.createElement("button"));
    const button = last.firstChild;
    button.textContent = "Open";
    button.setAttribute("aria-label", `Open the state of learner ${row.number}`);
    button.value = row.number;
    button.disabled = !row.here;
  });
}

function ago(seconds) {
  return seconds < 60 ? `${seconds} s ago` : `${Math.floor(seconds / 60)} min ago`;
}

function set() {
  send({ do: "set", stays: ID("stays").checked, everywhere: ID("everywhere").checked });
}

ID("lesson").addEventListener("change", steps);
ID("go").addEventListener("click", () => {
  chosen = "";
  send({ do: "go", lesson: ID("lesson").value, place: Number(ID("step").value) });
});
for (const name of ["open", "close", "run", "back"]) {
  ID(name).addEventListener("click", () => send({ do: "press", button: name }));
}
ID("stays").addEventListener("change", set);
ID("everywhere").addEventListener("change", set);
ID("rows").addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button) send({ do: "state", number: Number(button.value) });
});
connect(() => {
  const here = ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);
  send({ do: "here", address: here ? "" : location.href.split(/[?#]/)[0].replace(/\/class$/, "") });
}, write);
