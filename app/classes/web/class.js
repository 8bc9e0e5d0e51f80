"use strict";
// What both pages share: the connection, and the bars of a vote.
const ID = (name) => document.getElementById(name);
const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const news = { all: null, class: null, pose: null };
let socket = null;

function send(message) {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
}

function connect(opened, heard) {
  socket = new WebSocket(location.href.split(/[?#]/)[0].replace(/^http/, "ws"));
  socket.onopen = () => { say(""); opened(); };
  socket.onmessage = (event) => {
    const told = JSON.parse(event.data);
    for (const name of Object.keys(news)) if (name in told) news[name] = told[name];
    if ("say" in told) say(told.say);
    heard(told);
    if ("pose" in told || "all" in told) {
      drawRobot(ID("robot"), news.all && news.all.robot, news.pose, DARK.matches);
    }
  };
  socket.onclose = () => {
    say("The connection is interrupted; trying again …");
    setTimeout(() => connect(opened, heard), 1500 + 1500 * Math.random());
  };
}

function say(sentence) {
  if (ID("say").textContent !== sentence) ID("say").textContent = sentence;
}

function put(name, html) {
  const place = ID(name);
  if (place.shown !== html) { place.shown = html; place.innerHTML = html; }
}

function show(name, on) {
  ID(name).hidden = !on;
}

// The last round, with the round before it as a thin bar.
function bars(rounds) {
  if (!rounds.length) return "";
  const last = rounds[rounds.length - 1], first = rounds.length > 1 ? rounds[0] : null;
  const most = Math.max(1, ...rounds.flat().map((bar) => bar.count));
  return last.map((bar, k) => {
    const before = first ? `<span class="before" data-share="${(100 * first[k].count) / most}"></span>` : "";
    const mark = bar.right === true ? '<b class="right">✓ measured</b>' : "";
    const count = first ? `${first[k].count} → ${bar.count}` : `${bar.count}`;
    return `<li class="${bar.right === true ? "hit" : ""}"><span class="what">${bar.letter ? `<b>${bar.letter}</b> ` : ""}${bar.label} ${mark}</span>` +
      `<span class="track"><span class="now" data-share="${(100 * bar.count) / most}"></span>${before}</span>` +
      `<span class="count">${count}</span></li>`;
  }).join("");
}

// Widths are set by script: the page allows no style in HTML.
function spread() {
  for (const each of document.querySelectorAll("[data-share]")) each.style.width = `${each.dataset.share}%`;
}
