// The warehouse and the robots in it, as one drawing in mm that is panned and zoomed by its view box. What is on the
// floor is to scale; letters, hairlines and labels keep their size on the screen. For them the drawing has its scale
// in `--px`, the mm of one pixel.

/** @import { Robot as Model, Pose, Warehouse } from "../station/robot.js" */
/** @import { Face } from "../bar/face.js" */
/** @import { Grip } from "./aim.js" */
/** @import { Point, Scene, Target } from "./grid.js" */
/** @import { Box, Said } from "./labels.js" */
/** @import { Offer } from "./offers.js" */

import { Aim } from "./aim.js";
import { Floor } from "./floor.js";
import { Goods, carries } from "./goods.js";
import { ends, sideAt, way } from "./grid.js";
import { Labels, meets } from "./labels.js";
import { BODY, Robot } from "./robot.js";
import { crossing } from "../words/sentences.js";
import { make, set } from "../parts/svg.js";
import { Ways, blockedFor, nextOf } from "./ways.js";
import { decimal, put, say } from "../words/words.js";

/** How long a robot takes to glide to a new pose, in ms. */
const GLIDE_MS = 100;
/** What stays free about the floor in a fitted view, and above and below it for the map's words and buttons, in pixels. */
const MARGIN_PX = 32;
const ABOVE_PX = 40;
const BELOW_PX = 64;
/** While the warehouse is set up there are buttons above it, too, and its lengths stand beside it. */
const MARGIN_SET_UP_PX = 72;
const ABOVE_SET_UP_PX = 140;
/** So far below what stands over the map is said what belongs to nothing on it, in pixels. */
const NOWHERE_PX = 24;
/** The numbers of the columns stand below the floor. */
const NUMBERS_PX = 16;
/** How far in and out one can zoom: the width of the view in mm. */
const NEAREST_MM = 500;
const FARTHEST_MM = 200_000;
/** The lengths that the scale bar may have, in m. */
const BARS = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20];

const REDUCED = matchMedia("(prefers-reduced-motion: reduce)");
/** On a screen as large as this one stands further away: letters are larger by half. */
const FAR = matchMedia("(min-width: 2400px)");

export class WarehouseMap {
  /**
   * @param {SVGSVGElement} svg
   * @param {object} parts
   * @param {HTMLElement} parts.words
   * @param {HTMLElement} parts.scaleBar
   * @param {HTMLDetailsElement} parts.legend
   * @param {HTMLElement[]} parts.over what stands over the map's upper edge, if it is not hidden
   * @param {Record<"zoomIn" | "zoomOut" | "fit" | "follow", HTMLElement>} parts.tools
   * @param {{ tip: HTMLElement, offers: (target: Target | null) => Offer, grip: (target: Target | null) => Grip | null, isArmed: () => boolean, isPlacing: () => boolean }} parts.hand
   *   is what `Aim` takes and `isPlacing`, whether the warehouse is set up
   * @param {(words?: string) => void} parts.tell says something below the map
   */
  constructor(svg, { words, scaleBar, legend, over, tools, hand, tell }) {
    this.svg = svg;
    this.words = words;
    this.scaleBar = scaleBar;
    this.legend = legend;
    this.over = over;
    this.tell = tell;
    this.isPlacing = hand.isPlacing;
    this.followButton = tools.follow;
    /** What else is drawn at the scale of the map. */
    this.scaledAnew = () => {};
    /** @type {Warehouse | null} */
    this.warehouse = null;
    /**
     * Left, top, width and height of what is seen at least, in mm of the drawing.
     *
     * @type {[number, number, number, number]}
     */
    this.view = [0, 0, 1000, 1000];
    this.px = 1;
    /**
     * The scale at which letters and goods are drawn.
     *
     * @type {number | null}
     */
    this.scaled = null;
    this.following = false;
    this.floor = new Floor(svg);
    this.goods = new Goods(svg);
    this.ways = new Ways(svg);
    this.unsure = make("circle", { class: "unsure" }, svg);
    this.labels = new Labels(svg);
    this.others = make("g", {}, svg);
    this.body = new Robot(svg, "robot");
    this.ghost = new Robot(svg, "ghost");
    this.cross = make("circle", { class: "cross" }, svg);
    /** @type {Map<string, { group: SVGElement, robot: Robot }>} */
    this.robots = new Map();
    /** @type {Face | null} */
    this.state = null;
    /**
     * Where the robot is drawn, since when.
     *
     * @type {(Pose & { at: number }) | null}
     */
    this.shown = null;
    /**
     * Whose pose that is.
     *
     * @type {Model | null}
     */
    this.of = null;
    this.aim = new Aim(this, hand);
    tools.zoomIn.onclick = () => this.zoom(0.8);
    tools.zoomOut.onclick = () => this.zoom(1.25);
    tools.fit.onclick = () => this.fit();
    tools.follow.onclick = () => this.follow(!this.following);
    this.isFitted = true;
    /** The size of the map on the screen: to ask for it in each picture would cost a layout. */
    this.size = svg.getBoundingClientRect();
    new ResizeObserver(() => {
      this.size = svg.getBoundingClientRect();
      if (this.isFitted) this.fit();
      else this.show();
    }).observe(svg);
  }

  /**
   * Draws another warehouse, or the same with other goods.
   *
   * @param {Warehouse | null} warehouse
   */
  setWarehouse(warehouse) {
    const before = this.warehouse;
    this.warehouse = warehouse;
    this.aim.forget();
    this.floor.draw(warehouse);
    this.scaled = null;
    if (!warehouse) return this.show();
    const same = before && String(before.size) === String(warehouse.size) && before.side_length_cm === warehouse.side_length_cm;
    if (same) this.show();
    else this.fit();
  }

  /**
   * Keeps the robot in the middle of the view, until a person moves the view.
   *
   * @param {boolean} isOn
   */
  follow(isOn) {
    this.following = isOn;
    this.followButton.setAttribute("aria-pressed", String(isOn));
  }

  get side() {
    return this.floor.side;
  }

  /**
   * What the hand may mean.
   *
   * @returns {Scene}
   */
  get scene() {
    return { warehouse: this.warehouse, side: this.side, scale: this.px, parcels: this.goods.parcels, isPlacing: this.isPlacing() };
  }

  /**
   * The side of a square that a point in mm means; null outside.
   *
   * @param {Point} point
   */
  sideAt(point) {
    return sideAt(point, this.scene);
  }

  /**
   * Moves a robot to where it is now, or where it was last; called before each picture.
   *
   * @param {Model | null} robot
   * @param {number} now
   */
  move(robot, now) {
    const isKnown = robot?.state.x_mm !== undefined;
    const shown = isKnown || Boolean(robot?.pose);
    this.body.show(shown);
    this.ways.show(shown, isKnown);
    this.unsure.toggleAttribute("hidden", !shown);
    this.ghost.show(Boolean(robot?.truth));
    const stale = !robot || robot.isStale(now);
    this.svg.classList.toggle("stale", stale);
    this.svg.classList.toggle("lost", shown && !isKnown);
    this.svg.classList.toggle("stopped", robot?.state.stopped === "1");
    if (robot?.truth) this.ghost.move(robot.truth);
    if (!robot?.pose) return;
    const { unsure } = robot.pose;
    const pose = this.glide(this.floor.onWayOut(robot.pose), now, stale, this.of !== robot);
    this.of = robot;
    this.body.move(pose);
    this.labels.follow("chip", [pose.x, -pose.y]);
    // Where the axle may be: as wide as odometry is wrong until the next mark, and as it was driven by hand since.
    set(this.unsure, "cx", Math.round(pose.x));
    set(this.unsure, "cy", Math.round(-pose.y));
    const since = stale ? robot.mayHaveDriven(now) : 0;
    set(this.unsure, "r", Math.round(unsure + robot.strayed + since + (isKnown ? 0 : BODY.front)));
    if (this.following) this.centre(pose.x, -pose.y);
  }

  /**
   * Draws what changes now and then: ways, goods, the robots' states and what is said of them.
   *
   * @param {Model | null} robot
   * @param {Model[]} others
   * @param {number} now
   * @param {Face | null} state
   */
  draw(robot, others, now, state) {
    this.state = state;
    set(this.svg, "data-look", state?.look ?? "none");
    put(this.words, this.describe(robot));
    if (robot) {
      this.ways.drawThings(robot, this.side, this.px);
      this.goods.mark(robot);
      this.body.draw(robot.state, carries(robot), this.px);
      this.ghost.grow = this.body.grow;
      if (robot.state.x_mm !== undefined && this.shown) {
        this.ways.drawTrail(robot, this.floor, now);
        this.ways.drawRoute(robot, this.shown, this.side);
      }
    }
    this.drawOthers(others, now);
    this.drawLabels(robot, others);
    this.yieldLegend();
    this.aim.draw();
  }

  /**
   * The other robots of the station.
   *
   * @param {Model[]} robots
   * @param {number} now
   */
  drawOthers(robots, now) {
    const names = new Set(robots.map(({ name }) => name));
    for (const [name, { group, robot }] of this.robots) {
      group.toggleAttribute("hidden", !names.has(name));
      if (!names.has(name)) robot.show(false);
    }
    for (const one of robots) {
      if (!one.pose) continue;
      let other = this.robots.get(one.name);
      if (!other) {
        const group = make("g", { class: "other", "data-robot": one.name }, this.others);
        other = { group, robot: new Robot(group, "robot") };
        this.robots.set(one.name, other);
      }
      other.robot.show(true);
      other.robot.draw(one.state, carries(one), this.px);
      other.robot.move(this.floor.onWayOut(one.pose));
      other.group.classList.toggle("stale", one.isStale(now));
      other.group.classList.toggle("stopped", one.state.stopped === "1");
      other.group.classList.toggle("lost", one.state.x_mm === undefined);
    }
  }

  /**
   * What is said at robots, crossings and ways: the gravest first.
   *
   * @param {Model | null} robot
   * @param {Model[]} others
   */
  drawLabels(robot, others) {
    const { px, side } = this;
    const { look, chip } = this.state ?? {};
    const isKnown = robot?.state.x_mm !== undefined;
    const words = [chip, look !== "lost" && robot?.state.phase && !isKnown && say("place_unknown")].filter(Boolean).join(", ");
    const [left, top, right, bottom] = this.seen;
    // Below stand the map's own words and buttons.
    const above = Math.max(0, ...this.over.filter(({ hidden }) => !hidden).map(({ offsetTop, offsetHeight }) => offsetTop + offsetHeight));
    /** @type {Box} */
    const view = [left, top + above * px, right, bottom - BELOW_PX * px];
    const nowhere = top + (Math.max(ABOVE_PX, above) + NOWHERE_PX) * px;
    /** @type {Said[]} */
    const labels = [];
    /** @type {(box: Box | null, key: string, style: string, words: string) => void} */
    const about = (box, key, style, words) => {
      const [left, top, right, bottom] = box ?? [view[0], nowhere, view[2], nowhere];
      labels.push({ key, style, words, at: [(left + right) / 2, (top + bottom) / 2], reach: [(right - left) / 2, (bottom - top) / 2] });
    };
    if (words) about(this.body.box, "chip", "chip", words);
    const next = robot && nextOf(robot, side);
    /** @type {Point} */
    const ring = [10 * px, 10 * px];
    if (next) labels.push({ key: "next", style: "label flag", words: say("flag_next", robot?.state.next), at: [next[0], -next[1]], reach: ring });
    for (const blocked of robot?.blocked.keys() ?? []) {
      if (!robot) break;
      const [x, y] = way(blocked, side).middle;
      labels.push({ key: `blocked ${blocked}`, style: "label shut", words: say("flag_blocked", blockedFor(robot, blocked)), at: [x, -y], reach: ring });
    }
    for (const { name } of others.filter(({ pose }) => pose)) about(this.robots.get(name)?.robot.box ?? null, `of ${name}`, "label name-of", name);
    // One that moves with its robot is laid about the point that moves.
    const own = labels.find(({ key }) => key === "chip");
    if (own && this.body.pose) {
      const { x, y } = this.body.pose;
      own.reach = [own.reach[0] + Math.abs(own.at[0] - x), own.reach[1] + Math.abs(own.at[1] + y)];
      own.at = [x, -y];
    }
    this.labels.lay(labels, { hard: this.boxes, soft: this.goods.boxes, view, px });
  }

  /**
   * The boxes of all robots.
   *
   * @returns {Box[]}
   */
  get boxes() {
    const others = [...this.robots.values()].map(({ robot }) => robot.box);
    return [this.body.box, ...others].flatMap((box) => (box ? [box] : []));
  }

  /** The open legend stands where it covers no robot. */
  yieldLegend() {
    if (!this.legend.open) return;
    const robot = this.robotPixels();
    if (!robot) return;
    const zone = this.svg.getBoundingClientRect();
    const { left, top, right, bottom } = this.legend.getBoundingClientRect();
    if (meets([left - zone.left, top - zone.top, right - zone.left, bottom - zone.top], robot)) this.legend.classList.toggle("aside");
  }

  /**
   * The picture for somebody who does not see it.
   *
   * @param {Model | null} robot
   */
  describe(robot) {
    if (!this.warehouse) return say("no_map");
    const [width, height] = this.warehouse.size;
    /** @param {number} id */
    const gone = (id) => (robot?.gone.has(String(id)) ? ` (${say("away")})` : "");
    const goods = (this.warehouse.product ?? []).map(({ id, square, side }) => `${id} (${square.join(", ")}) ${say(side)}${gone(id)}`);
    const { node, looks, next } = robot?.state ?? {};
    /** @param {string[]} all */
    const ways = (all) => all.map((words) => ends(words).map(crossing).join("\u2013")).join("; ");
    return [
      say("text_size", width, height, goods.join("; ") || "\u2013"),
      node && looks ? say("text_robot", crossing(node), say(looks)) : robot ? say("text_lost") : "",
      next ? say("text_next", crossing(next)) : "",
      robot?.placed.length ? say("text_placed", ways(robot.placed)) : "",
      robot?.blocked.size ? say("text_blocked", ways([...robot.blocked.keys()])) : "",
    ].filter(Boolean).join(" ");
  }

  /**
   * Where to draw between two poses; another robot, or the same at another time, is where it is at once.
   *
   * @param {Pose} aim
   * @param {number} now
   * @param {boolean} stale
   * @param {boolean} isOther
   * @returns {Pose}
   */
  glide(aim, now, stale, isOther) {
    const still = REDUCED.matches;
    const shown = this.shown;
    if (!shown || still || isOther || Math.hypot(aim.x - shown.x, aim.y - shown.y) > 500) {
      this.shown = { ...aim, at: now };
      return aim;
    }
    if (stale) return shown;
    const part = Math.min(1, (now - shown.at) / GLIDE_MS);
    // From -180 to 180, however often it has turned round.
    const turn = ((((aim.heading - shown.heading + 180) % 360) + 360) % 360) - 180;
    const pose = {
      x: shown.x + (aim.x - shown.x) * part,
      y: shown.y + (aim.y - shown.y) * part,
      heading: shown.heading + turn * part,
    };
    this.shown = { ...pose, at: now };
    return pose;
  }

  /** All of the floor, above the map's words and buttons. */
  fit() {
    this.isFitted = true;
    if (!this.warehouse) return;
    const [left, top, right, bottom] = this.floor.bounds;
    const { width, height } = this.size;
    const grow = FAR.matches ? 1.5 : 1;
    const [aside, over] = this.isPlacing() ? [MARGIN_SET_UP_PX, ABOVE_SET_UP_PX] : [MARGIN_PX, ABOVE_PX];
    const [margin, above, below] = [aside * grow, over * grow, (BELOW_PX + NUMBERS_PX) * grow];
    const px = Math.max((right - left) / Math.max(1, width - 2 * margin), (top - bottom) / Math.max(1, height - above - below));
    this.view = [left - margin * px, -top - above * px, right - left + 2 * margin * px, top - bottom + (above + below) * px];
    this.follow(false);
    this.show();
  }

  /** Draws at the same scale anew, in another language. */
  redraw() {
    this.scaled = null;
    this.show();
  }

  /**
   * @param {number} by
   * @param {Point} about
   */
  zoom(by, [cx, cy] = [this.view[0] + this.view[2] / 2, this.view[1] + this.view[3] / 2]) {
    const [x, y, width, height] = this.view;
    if (width * by < NEAREST_MM || width * by > FARTHEST_MM) return;
    this.isFitted = false;
    this.view = [cx - (cx - x) * by, cy - (cy - y) * by, width * by, height * by];
    this.show();
  }

  /**
   * Moves the view by hand, in mm of the drawing.
   *
   * @param {number} x
   * @param {number} y
   */
  shift(x, y) {
    this.follow(false);
    this.isFitted = false;
    this.view[0] += x;
    this.view[1] += y;
    this.show();
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  centre(x, y) {
    this.isFitted = false;
    this.view = [x - this.view[2] / 2, y - this.view[3] / 2, this.view[2], this.view[3]];
    this.show();
  }

  /**
   * Brings a point of the floor into the view.
   *
   * @param {Point} point
   */
  reveal([x, y]) {
    const [left, top, right, bottom] = this.seen;
    if (x < left || x > right || -y < top || -y > bottom) {
      this.follow(false);
      this.centre(x, -y);
    }
  }

  show() {
    this.svg.setAttribute("viewBox", this.view.join(" "));
    const { pixel } = this;
    this.drawScale(pixel);
    // A large screen has larger letters and lines.
    const px = pixel * (FAR.matches ? 1.5 : 1);
    if (this.scaled === px) return;
    this.scaled = px;
    this.px = px;
    this.svg.style.setProperty("--px", String(px));
    this.floor.scale(px);
    this.scaledAnew();
    this.goods.draw(this.warehouse, this.side, px);
  }

  /**
   * A bar of one metre, or of what fits in a quarter of the map.
   *
   * @param {number} pixel mm of one pixel
   */
  drawScale(pixel) {
    const room = this.size.width / 4;
    const metres = BARS.findLast((metres) => (metres * 1_000) / pixel <= room) ?? 0.1;
    const [bar, length] = this.scaleBar.children;
    if (!(bar instanceof HTMLElement) || !length) return;
    bar.style.width = `${Math.round((metres * 1_000) / pixel / (FAR.matches ? 1.5 : 1))}px`;
    put(length, `${metres < 1 ? decimal(metres) : metres} m`);
  }

  /** How many mm of the drawing one pixel of the screen takes. */
  get pixel() {
    return Math.max(this.view[2] / (this.size.width || 1), this.view[3] / (this.size.height || 1));
  }

  /**
   * What is seen of the drawing, in mm.
   *
   * @returns {Box}
   */
  get seen() {
    const { pixel, size, view: [x, y, width, height] } = this;
    const [dx, dy] = [(size.width * pixel - width) / 2, (size.height * pixel - height) / 2];
    return [x - dx, y - dy, x + width + dx, y + height + dy];
  }

  /**
   * A point of the screen in mm of the drawing.
   *
   * @param {{ clientX: number, clientY: number }} event
   * @returns {Point}
   */
  point(event) {
    const matrix = this.svg.getScreenCTM()?.inverse();
    if (!matrix) return [0, 0];
    const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
    return [x, y];
  }

  /**
   * A point of the floor in pixels of the map.
   *
   * @param {Point} point
   * @returns {Point}
   */
  pixels([x, y]) {
    const [left, top] = this.seen;
    return [(x - left) / this.pixel, (-y - top) / this.pixel];
  }

  /**
   * The robot's box in pixels of the map; null if it is not shown.
   *
   * @returns {Box | null}
   */
  robotPixels() {
    const { box } = this.body;
    if (!box) return null;
    return [...this.pixels([box[0], -box[1]]), ...this.pixels([box[2], -box[3]])];
  }

  /**
   * A ring about what the keys mean.
   *
   * @param {Point | null} at
   */
  drawCross(at) {
    this.cross.toggleAttribute("hidden", !at);
    if (at) set(this.cross, "transform", `translate(${at[0]} ${-at[1]})`);
  }
}
