// The warehouse and the robots in it, as one drawing in mm that is panned and zoomed by its view box.

import { MM_PER_DUTY, SPAN_MS } from "./link.js";
import { crossing } from "./sentences.js";
import { put, say } from "./words.js";

const NS = "http://www.w3.org/2000/svg";
/** The body in mm: track of the wheels, length before and behind the axle. */
const BODY = { half: 90, front: 170, rear: 110 };
/** How long a robot takes to glide to a new pose, in ms. */
const GLIDE_MS = 100;
/** The trail fades in so many steps. */
const TRAIL = 6;
/** How far the ends of the warehouse are from the view's edge at least, in mm. */
const MARGIN = 250;
/** How much the buttons below take of the view, in pixels. */
const TOOLS_PX = 72;
/** The bends of the way out in degrees, to the left; what lies before the first one and the bar, in mm. */
const BENDS = { left: [90], right: [-90], s: [45, -45] };
const STRAIGHT = 200;
const BAR = 300;
const SIDES = { left: [-1, 0], up: [0, 1], right: [1, 0], down: [0, -1] };

/** An element of SVG with attributes. */
export function make(name, attributes = {}, parent = null, text = null) {
  const element = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (text !== null) element.textContent = text;
  parent?.append(element);
  return element;
}

const REDUCED = matchMedia("(prefers-reduced-motion: reduce)");

export class WarehouseMap {
  /** `act` is told of an edge that was clicked; while `placesGoods()`, `place` of a square's side. */
  constructor(svg, words, tools, act, placesGoods, place) {
    this.svg = svg;
    this.words = words;
    this.isArmed = tools.isArmed;
    this.act = act;
    this.placesGoods = placesGoods;
    this.place = place;
    this.warehouse = null;
    this.side = 400;
    this.view = [0, 0, 1000, 1000];
    this.following = false;
    this.floor = make("g", {}, svg);
    this.goods = make("g", {}, svg);
    this.placed = make("g", {}, svg);
    this.ways = make("g", {}, svg);
    this.trail = make("g", { class: "trail" }, svg);
    for (let step = 0; step < TRAIL; step++) make("polyline", { opacity: (0.5 * (TRAIL - step)) / TRAIL }, this.trail);
    this.gap = make("polyline", { class: "gap" }, svg);
    this.route = make("polyline", { class: "route" }, svg);
    this.next = make("circle", { class: "next", r: 70 }, svg);
    this.unsure = make("circle", { class: "unsure" }, svg);
    this.ghost = robotShape(svg, "ghost");
    this.cross = make("path", { class: "cross", d: "M-60 0H60M0 -60V60" }, svg);
    this.others = make("g", {}, svg);
    this.body = robotShape(svg, "robot");
    this.chip = make("g", { class: "chip" }, svg);
    make("rect", {}, this.chip);
    make("text", {}, this.chip);
    this.state = null;
    this.shown = null;
    this.pan();
    tools.zoomIn.onclick = () => this.zoom(0.8);
    tools.zoomOut.onclick = () => this.zoom(1.25);
    tools.fit.onclick = () => this.fit();
    tools.follow.onclick = () => {
      this.following = !this.following;
      tools.follow.setAttribute("aria-pressed", this.following);
    };
    this.stopFollowing = () => {
      this.following = false;
      tools.follow.setAttribute("aria-pressed", false);
    };
  }

  /** Draws another warehouse, or the same with other goods. */
  setWarehouse(warehouse) {
    const before = this.warehouse;
    this.warehouse = warehouse;
    this.floor.replaceChildren();
    this.goods.replaceChildren();
    if (!warehouse) return;
    this.side = warehouse.side_length_cm * 10;
    const [width, height] = warehouse.size;
    const [wide, high, beyond, inside] = [width * this.side, height * this.side, 130, 84];
    make("rect", { class: "floor", x: -beyond, y: -high - beyond, width: wide + 2 * beyond, height: high + 2 * beyond }, this.floor);
    for (let x = 0; x < width; x++) {
      for (let y = 1; y <= height; y++) {
        const length = this.side - 2 * inside;
        make("rect", { class: "rack", x: x * this.side + inside, y: inside - y * this.side, width: length, height: length }, this.floor);
      }
    }
    for (let x = 0; x <= width; x++) this.tape(x, 0, x, height);
    for (let y = 0; y <= height; y++) this.tape(0, y, width, y);
    this.exit();
    for (let x = 0; x <= width; x++) {
      for (let y = 0; y <= height; y++) {
        make("circle", { class: "node", cx: x * this.side, cy: -y * this.side, r: 14 }, this.floor);
      }
    }
    this.numbers(width, height);
    for (const good of warehouse.product ?? []) this.good(good);
    const same = before && String(before.size) === String(warehouse.size) && before.side_length_cm === warehouse.side_length_cm;
    if (!same) this.fit();
  }

  tape(x1, y1, x2, y2) {
    const at = (value) => value * this.side;
    make("line", { class: "tape", x1: at(x1), y1: -at(y1), x2: at(x2), y2: -at(y2) }, this.floor);
  }

  /** Columns are numbered above, rows at the side away from the way out. */
  numbers(width, height) {
    const size = this.letters;
    const number = (text, x, y) => make("text", { class: "axis", x, y, "font-size": size }, this.floor, text);
    for (let x = 0; x <= width; x++) number(x, x * this.side, -60 - size / 2 - height * this.side);
    const aside = this.warehouse.delivery[0] === 0 ? width * this.side + 60 + size : -60 - size;
    for (let y = 0; y <= height; y++) number(y, aside, size / 3 - y * this.side);
  }

  /** The way out of the delivery corner, and the bar at its end, as the warehouse's file has them. */
  exit() {
    const { curve = "straight", length_cm = 80, radius_cm = 30 } = this.warehouse.exit ?? {};
    const [x, y] = this.warehouse.delivery;
    const arcs = (BENDS[curve] ?? []).map((degrees) => (degrees * Math.PI) / 180);
    const radius = radius_cm * 10;
    const bent = arcs.reduce((sum, arc) => sum + radius * Math.abs(arc), 0);
    const first = arcs.length ? STRAIGHT : length_cm * 10;
    let at = { x: x * this.side, y: y * this.side, heading: x === 0 ? Math.PI : 0 };
    let path = `M${at.x} ${-at.y}`;
    const go = (length) => {
      at = { ...at, x: at.x + length * Math.cos(at.heading), y: at.y + length * Math.sin(at.heading) };
      path += `L${at.x} ${-at.y}`;
    };
    go(first);
    for (const arc of arcs) {
      const side = Math.sign(arc);
      const centre = at.heading + (side * Math.PI) / 2;
      const [cx, cy] = [at.x + radius * Math.cos(centre), at.y + radius * Math.sin(centre)];
      const end = centre + Math.PI + arc;
      at = { x: cx + radius * Math.cos(end), y: cy + radius * Math.sin(end), heading: at.heading + arc };
      path += `A${radius} ${radius} 0 0 ${side > 0 ? 0 : 1} ${at.x} ${-at.y}`;
    }
    if (arcs.length) go(length_cm * 10 - first - bent);
    this.wayOut = make("path", { class: "tape", d: path, fill: "none" }, this.floor);
    this.wayOutLength = this.wayOut.getTotalLength();
    const [dx, dy] = [Math.sin(at.heading) * BAR / 2, Math.cos(at.heading) * BAR / 2];
    make("line", { class: "bar", x1: at.x + dx, y1: -at.y + dy, x2: at.x - dx, y2: -at.y - dy }, this.floor);
    this.end = at;
  }

  /** Odometry counts the way out as if it were straight: where a pose on it is. */
  onWayOut(pose) {
    if (!this.warehouse) return pose;
    const [x, y] = this.warehouse.delivery.map((number) => number * this.side);
    const outwards = x === 0 ? -1 : 1;
    const far = (pose.x - x) * outwards;
    if (far <= 0 || Math.abs(pose.y - y) >= 1) return pose;
    const end = this.wayOutLength - 1;
    const [at, ahead] = [0, 1].map((mm) => this.wayOut.getPointAtLength(Math.min(far, end) + mm));
    const along = (Math.atan2(ahead.x - at.x, at.y - ahead.y) * 180) / Math.PI;
    return { x: at.x, y: -at.y, heading: pose.heading + along - outwards * 90 };
  }

  /** How large letters are, in mm: they grow with the warehouse. */
  get letters() {
    return Math.max(60, (Math.max(...this.warehouse.size) * this.side) / 60);
  }

  /** A box in its square, at the side from which it is reached. */
  good({ id, name, square, side }) {
    const [dx, dy] = SIDES[side] ?? [0, 0];
    // In a large warehouse it is larger than it is, so that its number can be read.
    const half = Math.min(Math.max(60, this.letters * 0.7), this.side / 4);
    const reach = this.side / 2 - 50 - half;
    const x = (square[0] + 0.5) * this.side + dx * reach;
    const y = -((square[1] + 0.5) * this.side + dy * reach);
    const box = make("g", { class: "good", "data-product": id }, this.goods);
    make("title", {}, box, name ? `${id} ${name}` : String(id));
    make("rect", { x: x - half, y: y - half, width: 2 * half, height: 2 * half, rx: half / 5 }, box);
    make("text", { x, y: y + half * 0.47, "font-size": half * 1.33 }, box, String(id));
    make("text", { class: "why", x, y: y + half + 70, "font-size": half }, box);
  }

  /** Moves a robot to where it is now, or where it was last; called before each picture. */
  move(robot, now) {
    const isKnown = robot?.state.x_mm !== undefined;
    const shown = isKnown || Boolean(robot?.pose);
    for (const part of [this.body, this.unsure, this.trail]) part.toggleAttribute("hidden", !shown);
    for (const part of [this.gap, this.route, this.next]) part.toggleAttribute("hidden", !isKnown);
    this.sayState(robot, isKnown);
    this.ghost.toggleAttribute("hidden", !robot?.truth);
    const stale = !robot || robot.isStale(now);
    this.svg.classList.toggle("stale", stale);
    this.svg.classList.toggle("lost", shown && !isKnown);
    this.svg.classList.toggle("stopped", robot?.state.stopped === "1");
    if (robot?.truth) place(this.ghost, robot.truth);
    if (!shown) return;
    const { unsure } = robot.pose;
    const pose = this.glide(this.onWayOut(robot.pose), now, stale);
    place(this.body, pose);
    // Where the axle may be: as wide as odometry is wrong until the next mark, and as it was driven by hand since.
    set(this.unsure, "cx", Math.round(pose.x));
    set(this.unsure, "cy", Math.round(-pose.y));
    const since = stale ? unheardMm(robot, now) : 0;
    set(this.unsure, "r", Math.round(unsure + robot.strayed + since + (isKnown ? 0 : BODY.front)));
    if (this.following) this.centre(pose.x, -pose.y);
  }

  /** Its state at the robot: where it is or was last or, for who has not seen it, over the map. */
  sayState(robot, isKnown) {
    const { look, chip } = this.state ?? {};
    const words = [chip, look !== "lost" && robot?.state.phase && !isKnown && say("place_unknown")].filter(Boolean).join(", ");
    this.chip.toggleAttribute("hidden", !words);
    if (!words) return;
    const size = this.warehouse ? this.letters : 80;
    const [left, top, width] = this.view;
    const { pose } = robot;
    const [x, y] = [pose?.x ?? left + width / 2, pose ? -pose.y + BODY.front + size : top + 1.5 * size];
    const [box, text] = this.chip.children;
    if (text.textContent !== words || text.getAttribute("font-size") !== String(size)) {
      put(text, words);
      set(text, "font-size", size);
      const long = text.getComputedTextLength() + size;
      for (const [key, value] of Object.entries({ x: -long / 2, y: -size * 1.1, width: long, height: size * 1.6, rx: size / 5 })) set(box, key, value);
    }
    set(this.chip, "transform", `translate(${Math.round(x)} ${Math.round(y)})`);
  }

  /** Draws what changes now and then: ways, goods and the robot's state. */
  draw(robot, now, state) {
    this.state = state;
    put(this.words, this.describe(robot));
    if (!robot) return;
    this.drawPlaced(robot);
    this.drawBlocked(robot);
    this.markGoods(robot);
    if (robot.state.x_mm === undefined || !this.shown) return;
    this.drawTrail(robot, now);
    this.drawWay(robot, this.shown);
  }

  /** The other robots of the station, each with its name. */
  drawOthers(robots, now) {
    for (const robot of robots.filter(({ pose }) => pose)) {
      let other = [...this.others.children].find(({ dataset }) => dataset.robot === robot.name);
      if (!other) {
        other = make("g", { class: "other", "data-robot": robot.name }, this.others);
        robotShape(other, "robot").removeAttribute("hidden");
        make("text", {}, other, robot.name);
      }
      const [body, name] = other.children;
      const pose = this.onWayOut(robot.pose);
      place(body, pose);
      for (const [key, value] of Object.entries({ x: Math.round(pose.x), y: Math.round(-pose.y - BODY.front - 20), "font-size": this.warehouse ? this.letters : 80 })) set(name, key, value);
      other.classList.toggle("stale", robot.isStale(now));
      other.classList.toggle("stopped", robot.state.stopped === "1");
      other.classList.toggle("lost", robot.state.x_mm === undefined);
    }
    const names = robots.map(({ name }) => name);
    for (const other of this.others.children) other.toggleAttribute("hidden", !names.includes(other.dataset.robot));
  }

  /** The picture for somebody who does not see it. */
  describe(robot) {
    if (!this.warehouse) return say("no_map");
    const [width, height] = this.warehouse.size;
    const goods = (this.warehouse.product ?? []).map(({ id, square, side }) => `${id} (${square.join(", ")}) ${say(side)}`);
    const { node, looks, next } = robot?.state ?? {};
    return [
      say("text_size", width, height, goods.join("; ") || "\u2013"),
      node && looks ? say("text_robot", crossing(node), say(looks)) : robot ? say("text_lost") : "",
      next ? say("text_next", crossing(next)) : "",
      robot?.placed.length ? say("text_placed", robot.placed.map((way) => way.split(" ")).map(([x, y, side]) => `(${x}, ${y}) ${say(side)}`).join("; ")) : "",
      robot?.blocked.size ? say("text_blocked", [...robot.blocked.keys()].map((way) => way.split(" ")).map(([x, y, side]) => `(${x}, ${y}) ${say(side)}`).join("; ")) : "",
    ].filter(Boolean).join(" ");
  }

  /** Where to draw between two poses. */
  glide(aim, now, stale) {
    const still = REDUCED.matches;
    const shown = this.shown;
    const jump = !shown || still || Math.hypot(aim.x - shown.x, aim.y - shown.y) > 500;
    const part = jump ? 1 : Math.min(1, (now - shown.at) / GLIDE_MS);
    // From -180 to 180, however often it has turned round.
    const turn = jump ? 0 : ((((aim.heading - shown.heading + 180) % 360) + 360) % 360) - 180;
    const pose = {
      x: jump ? aim.x : shown.x + (aim.x - shown.x) * part,
      y: jump ? aim.y : shown.y + (aim.y - shown.y) * part,
      heading: jump ? aim.heading : shown.heading + turn * part,
    };
    if (!stale || jump) this.shown = { ...pose, at: now };
    return stale && shown ? shown : pose;
  }

  drawTrail(robot, now) {
    // One point in four, and nothing new between them.
    const count = Math.floor(robot.total / 4);
    if (this.trailed === count && this.trailOf === robot) return;
    this.trailed = count;
    this.trailOf = robot;
    const steps = Array.from({ length: TRAIL }, () => []);
    for (let i = robot.past.length - 1; i >= 0; i -= 4) {
      const { at, x, y } = robot.past[i];
      if (now - at > SPAN_MS) break;
      if (x === null || y === null) continue;
      const drawn = this.onWayOut({ x, y, heading: 0 });
      const point = `${Math.round(drawn.x)},${-Math.round(drawn.y)}`;
      const step = Math.floor(((now - at) * TRAIL) / SPAN_MS);
      // Each step begins where the younger one ends.
      if (step > 0 && !steps[step]?.length) steps[step - 1].push(point);
      steps[step]?.push(point);
    }
    steps.forEach((points, step) => set(this.trail.children[step], "points", points.join(" ")));
  }

  drawWay(robot, pose) {
    const nodes = robot.route.map(([x, y]) => `${x * this.side},${-y * this.side}`);
    for (const line of [this.gap, this.route]) set(line, "points", [`${Math.round(pose.x)},${Math.round(-pose.y)}`, ...nodes].join(" "));
    const next = robot.state.next?.split(",").map(Number);
    this.next.toggleAttribute("hidden", !next);
    if (next) {
      set(this.next, "cx", next[0] * this.side);
      set(this.next, "cy", -next[1] * this.side);
    }
  }

  /** What was put on ways, as bars across them; what the robot has found blocked is a cross. */
  drawPlaced(robot) {
    const shown = [this.side, ...robot.placed].join(";");
    if (this.shownPlaced === shown) return;
    this.shownPlaced = shown;
    this.placed.replaceChildren();
    for (const way of robot.placed) {
      const [x, y, side] = way.split(" ");
      const [dx, dy] = SIDES[side] ?? [0, 0];
      const [cx, cy] = [(Number(x) + dx / 2) * this.side, -(Number(y) + dy / 2) * this.side];
      const [width, height] = dx ? [60, 220] : [220, 60];
      const bar = make("rect", { class: "placed", x: cx - width / 2, y: cy - height / 2, width, height }, this.placed);
      make("title", { "data-word": "placed" }, bar, say("placed"));
    }
  }

  drawBlocked(robot) {
    const shown = [...robot.blocked.keys()].join(";");
    const seconds = Math.floor(Number(robot.state.time_ms) / 1_000);
    if (this.shownBlocked === shown && this.shownSecond === seconds) return;
    this.shownBlocked = shown;
    this.shownSecond = seconds;
    this.ways.replaceChildren();
    for (const [way, since] of robot.blocked) {
      const [x, y, side] = way.split(" ");
      const [dx, dy] = SIDES[side] ?? [0, 0];
      const [cx, cy] = [(Number(x) + dx / 2) * this.side, -(Number(y) + dy / 2) * this.side];
      const cross = make("g", { class: "blocked" }, this.ways);
      make("title", { "data-word": "found" }, cross, say("found"));
      make("path", { d: `M${cx - 60} ${cy - 60}l120 120m0 -120l-120 120` }, cross);
      make("text", { x: cx + 75, y: cy - 40 }, cross, `${Math.max(0, seconds - since)} s`);
    }
  }

  markGoods(robot) {
    for (const box of this.goods.children) {
      const id = box.dataset.product;
      const [isWanted, isQueued] = [robot.state.product === id, robot.queue.some(({ product }) => product === id)];
      const noWay = ["no_way", "unreachable"].includes(robot.state.failure);
      const isOutOfReach = isWanted ? noWay : isQueued && robot.unreachable.has(id);
      set(box, "class", `good ${isWanted ? "wanted" : isQueued ? "queued" : ""} ${isOutOfReach ? "out-of-reach" : ""}`);
      const words = box.lastElementChild;
      if (words.textContent !== (isOutOfReach ? say("no_way") : "")) words.textContent = isOutOfReach ? say("no_way") : "";
    }
  }

  fit() {
    if (!this.warehouse) return;
    const [width, height] = this.warehouse.size.map((squares) => squares * this.side);
    const [left, right] = [Math.min(0, this.end.x), Math.max(width, this.end.x)];
    const [low, high] = [Math.min(0, this.end.y), Math.max(height, this.end.y)];
    const margin = Math.max(MARGIN, 100 + 2 * this.letters);
    const across = right - left + 2 * margin;
    const down = high - low + 2 * margin;
    // Below stand the map's buttons.
    const box = this.svg.getBoundingClientRect();
    const scale = Math.max(across / (box.width || 1), down / (box.height || 1));
    const below = Math.max(0, TOOLS_PX * scale - margin);
    this.view = [left - margin, -high - margin, across, down + below];
    this.stopFollowing?.();
    this.show();
  }

  zoom(by, [cx, cy] = [this.view[0] + this.view[2] / 2, this.view[1] + this.view[3] / 2]) {
    const [x, y, width, height] = this.view;
    if (width * by < 500 || width * by > 200_000) return;
    this.view = [cx - (cx - x) * by, cy - (cy - y) * by, width * by, height * by];
    this.show();
  }

  centre(x, y) {
    this.view = [x - this.view[2] / 2, y - this.view[3] / 2, this.view[2], this.view[3]];
    this.show();
  }

  show() {
    this.svg.setAttribute("viewBox", this.view.join(" "));
    const [x, y, width, height] = this.view;
    set(this.cross, "transform", `translate(${x + width / 2} ${y + height / 2}) scale(${width / 2_000})`);
  }

  /** A point of the screen in mm of the drawing. */
  point(event) {
    const matrix = this.svg.getScreenCTM()?.inverse();
    if (!matrix) return [0, 0];
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
    return [x, y];
  }

  /** Drag or arrows to pan, wheel, two fingers or + and - to zoom; a click or Enter meets an edge. */
  pan() {
    let from = null;
    let moved = 0;
    const fingers = new Map();
    const apart = () => {
      const [a, b] = [...fingers.values()];
      return { far: Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY), clientX: (a.clientX + b.clientX) / 2, clientY: (a.clientY + b.clientY) / 2 };
    };
    this.svg.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, event);
      from = this.point(event);
      // A second finger zooms, so the first one meets nothing.
      moved = fingers.size > 1 ? Infinity : 0;
      this.svg.setPointerCapture(event.pointerId);
    });
    this.svg.addEventListener("pointermove", (event) => {
      if (!from) return;
      if (fingers.size === 2 && fingers.has(event.pointerId)) {
        const before = apart().far;
        fingers.set(event.pointerId, event);
        const now = apart();
        if (before > 0 && now.far > 0) this.zoom(before / now.far, this.point(now));
        return;
      }
      const [x, y] = this.point(event);
      moved += Math.hypot(event.movementX, event.movementY);
      if (moved < 5) return;
      this.stopFollowing();
      this.view[0] -= x - from[0];
      this.view[1] -= y - from[1];
      this.show();
    });
    this.svg.addEventListener("pointerup", (event) => {
      fingers.delete(event.pointerId);
      if (from && moved < 5) this.meetEdge(this.point(event));
      from = null;
    });
    this.svg.addEventListener("pointercancel", (event) => {
      fingers.delete(event.pointerId);
      from = null;
    });
    this.svg.addEventListener("keydown", (event) => this.key(event));
    this.svg.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(event.deltaY > 0 ? 1.1 : 0.9, this.point(event));
    }, { passive: false });
  }

  /** Keys of the map itself, while the arrows do not drive. */
  key(event) {
    const [x, y, width, height] = this.view;
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey) return;
    if (step && this.isArmed()) return;
    if (step) {
      this.stopFollowing();
      this.view = [x + (step[0] * width) / 10, y + (step[1] * height) / 10, width, height];
      this.show();
    } else if (event.key === "+") this.zoom(0.8);
    else if (event.key === "-") this.zoom(1.25);
    else if (event.key === "Enter" && !event.repeat) this.meetEdge([x + width / 2, y + height / 2]);
    else return;
    event.preventDefault();
  }

  /** The side of a square that a click is nearest to gets goods. */
  meetSquare([gx, gy]) {
    const square = [Math.floor(gx), Math.floor(gy)];
    const [width, height] = this.warehouse.size;
    if (square[0] < 0 || square[1] < 0 || square[0] >= width || square[1] >= height) return;
    this.place(square, nearestSide(gx - square[0], gy - square[1]));
  }

  /** The edge of the grid that a click is near to, if it is near to one. */
  meetEdge([px, py]) {
    if (!this.warehouse) return;
    const [gx, gy] = [px / this.side, -py / this.side];
    const [width, height] = this.warehouse.size;
    const [nx, ny] = [Math.round(gx), Math.round(gy)];
    const near = 0.15;
    if (this.placesGoods()) return this.meetSquare([gx, gy]);
    let edge = null;
    if (Math.abs(gy - ny) < near && gx > 0 && gx < width) edge = [Math.floor(gx), ny, "right"];
    else if (Math.abs(gx - nx) < near && gy > 0 && gy < height) edge = [nx, Math.floor(gy), "up"];
    const isThere = edge && edge[0] >= 0 && edge[1] >= 0 && edge[0] <= width && edge[1] <= height;
    this.act(isThere ? edge : undefined);
  }
}

/** The side of its square that a point is nearest to. */
function nearestSide(x, y) {
  const ways = { left: x, right: 1 - x, down: y, up: 1 - y };
  return Object.keys(ways).reduce((best, side) => (ways[side] < ways[best] ? side : best));
}

function robotShape(svg, name) {
  const group = make("g", { class: name, hidden: "" }, svg);
  make("title", { "data-word": name }, group, say(name));
  const { half, front, rear } = BODY;
  // It looks up at 0 degrees.
  make("path", { d: `M${-half} ${rear}V${-front + 50}L${-half + 50} ${-front}H${half - 50}L${half} ${-front + 50}V${rear}Z` }, group);
  make("path", { class: "arrow", d: `M0 ${-front + 25}l45 70h-90z` }, group);
  // Hatched, while it is stopped.
  make("path", { class: "hatch", d: hatch() }, group);
  return group;
}

/** Lines across the body, from its left edge up to the right. */
function hatch() {
  const [half, front, rear] = [BODY.half - 8, BODY.front - 45, BODY.rear - 8];
  let path = "";
  for (let from = rear + 2 * half - 30; from > -front - 2 * half; from -= 55) {
    const [low, high] = [Math.max(0, from - rear), Math.min(2 * half, from + front)];
    if (low < high) path += `M${low - half} ${from - low}L${high - half} ${from - high}`;
  }
  return path;
}

/** How far a robot that is not heard may have driven at its last speed, in mm. */
function unheardMm({ state: { left_duty: left = 0, right_duty: right = 0 }, stated }, now) {
  return Math.max(Number(left), Number(right)) * MM_PER_DUTY * Math.min(Math.max(0, now - stated) / 1_000, 60);
}

function place(group, { x, y, heading }) {
  set(group, "transform", `translate(${x.toFixed(1)} ${(-y).toFixed(1)}) rotate(${heading.toFixed(1)})`);
}

/** Changes an attribute only where it is another one: what is as it was is not painted again. */
function set(element, name, value) {
  if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
}
