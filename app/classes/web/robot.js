"use strict";
// Draws a robot of capsules, seen from the front right and slightly from above. Nearer capsules are drawn later.
const VIEW = { turn: 2.5, tilt: 0.3 };

function drawRobot(canvas, shape, pose, dark) {
  const pixel = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width || !height) return;
  if (canvas.width !== Math.round(width * pixel) || canvas.height !== Math.round(height * pixel)) {
    canvas.width = Math.round(width * pixel);
    canvas.height = Math.round(height * pixel);
  }
  const brush = canvas.getContext("2d");
  brush.setTransform(pixel, 0, 0, pixel, 0, 0);
  brush.clearRect(0, 0, width, height);
  if (!shape || !pose) return;
  const parts = shape.capsules.map((each) => {
    const [joint, ax, ay, az, bx, by, bz, radius] = each;
    const at = joint === 0 ? null : pose.joints[joint - 1];
    return { a: inWorld(at, [ax, ay, az]), b: inWorld(at, [bx, by, bz]), radius, joint };
  });
  const frame = frameOf(canvas, parts, width, height);
  drawFloor(brush, frame, dark);
  for (const part of parts) {
    part.p = seen(part.a, frame);
    part.q = seen(part.b, frame);
  }
  parts.sort((one, other) => one.p[2] + one.q[2] - other.p[2] - other.q[2]);
  brush.lineCap = "round";
  for (const { p, q, radius, joint } of parts) {
    const wide = Math.max(2, 2 * radius * frame.scale);
    const light = 52 + 16 * Math.min(1, Math.max(-1, (p[2] + q[2]) / 1200));
    stroke(brush, p, q, wide + 2.5, dark ? "#1b1f24" : "#39424d");
    stroke(brush, p, q, wide, `hsl(${joint % 2 ? 212 : 28} ${joint ? 62 : 8}% ${light}%)`);
    stroke(brush, [p[0] - wide / 6, p[1] - wide / 6], [q[0] - wide / 6, q[1] - wide / 6], wide / 3,
      "rgba(255,255,255,0.28)");
  }
  const hand = seen(pose.joints[pose.joints.length - 1], frame);
  brush.fillStyle = "#d72626";
  brush.beginPath();
  brush.arc(hand[0], hand[1], 5, 0, 7);
  brush.fill();
}

function stroke(brush, p, q, wide, colour) {
  brush.strokeStyle = colour;
  brush.lineWidth = wide;
  brush.beginPath();
  brush.moveTo(p[0], p[1]);
  brush.lineTo(q[0] + 0.01, q[1]);
  brush.stroke();
}

function inWorld(at, [x, y, z]) {
  if (!at) return [x, y, z];
  const [px, py, pz, w, i, j, k] = at;
  // v + 2 w (u × v) + 2 u × (u × v)
  const cx = j * z - k * y, cy = k * x - i * z, cz = i * y - j * x;
  return [
    px + x + 2 * (w * cx + j * cz - k * cy),
    py + y + 2 * (w * cy + k * cx - i * cz),
    pz + z + 2 * (w * cz + i * cy - j * cx),
  ];
}

function turned([x, y, z]) {
  const c = Math.cos(VIEW.turn), s = Math.sin(VIEW.turn);
  const right = s * x - c * y, away = c * x + s * y;
  const ct = Math.cos(VIEW.tilt), st = Math.sin(VIEW.tilt);
  return [right, -(ct * z + st * away), st * z - ct * away];
}

// The frame grows with the robot's motion and never shrinks, so that the picture does not jump.
function frameOf(canvas, parts, width, height) {
  const key = parts.length;
  let box = canvas.box;
  if (!box || box.key !== key) box = canvas.box = { key, low: [Infinity, Infinity], high: [-Infinity, -Infinity] };
  for (const part of parts) {
    for (const end of [part.a, part.b, [part.a[0], part.a[1], 0]]) {
      const [x, y] = turned(end);
      box.low = [Math.min(box.low[0], x - part.radius), Math.min(box.low[1], y - part.radius)];
      box.high = [Math.max(box.high[0], x + part.radius), Math.max(box.high[1], y + part.radius)];
    }
  }
  const size = [box.high[0] - box.low[0], box.high[1] - box.low[1]];
  const scale = Math.min((0.8 * width) / Math.max(size[0], 1), (0.86 * height) / Math.max(size[1], 1));
  return {
    scale,
    x: width / 2 - (scale * (box.low[0] + box.high[0])) / 2,
    y: height / 2 - (scale * (box.low[1] + box.high[1])) / 2,
  };
}

function seen(point, frame) {
  const [x, y, depth] = turned(point);
  return [frame.x + frame.scale * x, frame.y + frame.scale * y, depth];
}

function drawFloor(brush, frame, dark) {
  brush.strokeStyle = dark ? "#333a42" : "#dde2e8";
  brush.lineWidth = 1;
  for (let k = -10; k <= 10; k += 1) {
    for (const [p, q] of [[[k * 250, -2500, 0], [k * 250, 2500, 0]], [[-2500, k * 250, 0], [2500, k * 250, 0]]]) {
      const a = seen(p, frame), b = seen(q, frame);
      brush.beginPath();
      brush.moveTo(a[0], a[1]);
      brush.lineTo(b[0], b[1]);
      brush.stroke();
    }
  }
}
