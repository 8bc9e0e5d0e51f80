"use strict";
// The code that both pages share: the connection, and the bars of a vote.
const ID = (name) => document.getElementById(name);
const DARK = window.matchMedia("(prefers-color-scheme: dark)");
const news = { all: null, class: null, pose: null };
let socket = null;

// A web socket does not say why it was refused. A class that has started anew has another code and secret.
async function isRefused() {
  try {
    return (await fetch(location.href.split(/[?#]/)[0], { method: "HEAD", cache: "no-store" })).status === 403;
  } catch {
    return false;
  }
}

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
    if ("pose" in told || "all" in told) move();
  };
  socket.onclose = async () => {
    say("The connection is interrupted; trying again …");
    if (await isRefused()) say(ANEW);
    else setTimeout(() => connect(opened, heard), 1500 + 1500 * Math.random());
  };
}

// Poses arrive five times a second. The robot is drawn between the last two poses, a fifth of a second late.
const PERIOD = 200, STILL = window.matchMedia("(prefers-reduced-motion: reduce)");
const moving = { from: null, to: null, began: 0, drawing: false };

function move() {
  const pose = news.pose, now = performance.now();
  if (pose !== moving.to) {
    const same = moving.to && pose && moving.to.joints.length === pose.joints.length && pose.t >= moving.to.t;
    moving.from = same && !STILL.matches ? between(now) : pose;
    moving.to = pose;
    moving.began = now;
  }
  if (!moving.drawing) {
    moving.drawing = true;
    requestAnimationFrame(draw);
  }
}

function draw(now) {
  drawRobot(ID("robot"), news.all && news.all.robot, between(now), DARK.matches);
  moving.drawing = now < moving.began + PERIOD;
  if (moving.drawing) requestAnimationFrame(draw);
}

function between(now) {
  const { from, to, began } = moving;
  const share = Math.min(1, Math.max(0, (now - began) / PERIOD));
  if (!from || !to || share === 1) return to;
  return {
    t: to.t,
    joints: to.joints.map((last, k) => {
      const first = from.joints[k];
      const sign = [3, 4, 5, 6].reduce((sum, i) => sum + first[i] * last[i], 0) < 0 ? -1 : 1;
      const mixed = last.map((x, i) => (1 - share) * (i > 2 ? sign : 1) * first[i] + share * x);
      const size = Math.hypot(...mixed.slice(3)) || 1;
      return mixed.map((x, i) => (i > 2 ? x / size : x));
    }),
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

// Draws the last round, with the round before it as a thin bar.
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

// The script sets the widths, as the page allows no style in HTML.
function spread() {
  for (const each of document.querySelectorAll("[data-share]")) each.style.width = `${each.dataset.share}%`;
}
