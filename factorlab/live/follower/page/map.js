// The ground from above: the line, the way that was driven, the way that is believed, and the robot.

const MARGIN = 18; // px
const LONG_M = 4;

export function colours(...names) {
  const style = getComputedStyle(document.documentElement);
  return names.map((name) => style.getPropertyValue(`--${name}`).trim());
}

// A canvas as sharp as the screen, and its size in CSS pixels.
export function sharp(canvas) {
  const ratio = devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return { pen, width, height };
}

export class GroundMap {
  constructor(canvas) {
    this.canvas = canvas;
    this.line = [];
    this.close = false;
  }

  // `way` and `ghost`: rows [t, x, y, x and y estimated, x and y by odometry, …]; `step`: the newest, with its covariance.
  draw(way, ghost, step) {
    const { pen, width, height } = sharp(this.canvas);
    if (!this.line.length) return;
    const view = this.view(width, height, step);
    const [track, truth, guess, faint, soft] = colours("track", "truth", "guess", "ghost", "soft");
    const stroke = (rows, i, j, colour, thick, dash = []) => {
      pen.beginPath();
      rows.forEach((row, k) => pen[k ? "lineTo" : "moveTo"](view.x(row[i]), view.y(row[j])));
      pen.strokeStyle = colour;
      pen.lineWidth = thick;
      pen.setLineDash(dash);
      pen.stroke();
      pen.setLineDash([]);
    };
    pen.lineJoin = pen.lineCap = "round";
    pen.globalAlpha = 0.35;
    stroke(this.line, 0, 1, track, Math.max(2, view.scale * 0.02)); // 2 cm wide, as it is
    pen.globalAlpha = 1;
    stroke(ghost, 1, 2, faint, 1.4);
    stroke(way, 1, 2, truth, 2);
    stroke(way, 5, 6, soft, 1.2, [1, 4]);
    stroke(way, 3, 4, guess, 1.6, [5, 4]);
    if (step) {
      this.robot(pen, view, step.pose, truth);
      this.ellipse(pen, view, step, guess);
    }
    this.ruler(pen, view, height, soft);
  }

  view(width, height, step) {
    let [left, right, low, high] = bounds(this.line);
    const [x, y] = step ? step.pose : this.line[0];
    if (this.close) [left, right, low, high] = [x - 0.4, x + 0.4, y - 0.25, y + 0.25];
    else if (right - left > LONG_M) [left, right] = [x - 0.7 * LONG_M, x + 0.3 * LONG_M]; // a part of a long line
    const scale = Math.min((width - 2 * MARGIN) / (right - left), (height - 2 * MARGIN) / Math.max(high - low, 0.3));
    const [cx, cy] = [(left + right) / 2, (low + high) / 2];
    return { scale, x: (x) => width / 2 + scale * (x - cx), y: (y) => height / 2 - scale * (y - cy) };
  }

  // A triangle as long as the robot, but never too small to be seen.
  robot(pen, view, [x, y, theta], colour) {
    const size = Math.max(9, 0.08 * view.scale);
    pen.save();
    pen.translate(view.x(x), view.y(y));
    pen.rotate(-theta);
    pen.beginPath();
    pen.moveTo(size, 0);
    pen.lineTo(-0.7 * size, 0.65 * size);
    pen.lineTo(-0.7 * size, -0.65 * size);
    pen.closePath();
    pen.fillStyle = pen.strokeStyle = colour;
    pen.globalAlpha = size > 20 ? 0.3 : 1; // near by, what is believed shows through
    pen.fill();
    pen.restore();
    pen.globalAlpha = 1;
  }

  // Where the filter believes the robot to be, in 99 cases of 100: three standard deviations.
  ellipse(pen, view, { estimate: [x, y], cov: [xx, xy, yy] }, colour) {
    const mean = (xx + yy) / 2;
    const spread = Math.hypot((xx - yy) / 2, xy);
    const axis = (variance) => 3 * Math.sqrt(Math.max(variance, 0)) * view.scale;
    pen.beginPath();
    pen.ellipse(view.x(x), view.y(y), axis(mean + spread), axis(mean - spread), -Math.atan2(2 * xy, xx - yy) / 2, 0, 2 * Math.PI);
    pen.strokeStyle = colour;
    pen.lineWidth = 1.8;
    pen.stroke();
    pen.beginPath();
    pen.arc(view.x(x), view.y(y), 2.5, 0, 2 * Math.PI);
    pen.fillStyle = colour;
    pen.fill();
  }

  ruler(pen, view, height, colour) {
    const length = [0.1, 0.2, 0.5, 1, 2, 5].find((one) => one * view.scale > 50) ?? 5;
    const [x, y] = [MARGIN - 6, height - 12];
    pen.strokeStyle = pen.fillStyle = colour;
    pen.lineWidth = 1.5;
    pen.beginPath();
    pen.moveTo(x, y - 4);
    pen.lineTo(x, y);
    pen.lineTo(x + length * view.scale, y);
    pen.lineTo(x + length * view.scale, y - 4);
    pen.stroke();
    pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
    pen.fillText(length < 1 ? `${Math.round(100 * length)} cm` : `${length} m`, x + 6, y - 6);
  }
}

function bounds(points) {
  const limits = [Infinity, -Infinity, Infinity, -Infinity];
  for (const [x, y] of points) {
    limits[0] = Math.min(limits[0], x);
    limits[1] = Math.max(limits[1], x);
    limits[2] = Math.min(limits[2], y);
    limits[3] = Math.max(limits[3], y);
  }
  return limits;
}
