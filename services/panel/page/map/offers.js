// What the things on the map are, and what a click on one does now: the one place for tip and click. A click offers only
// what the robot can do: it has no order to go to a crossing, so a click on a crossing says where the robot stands.

/** @import { Link } from "../station/link.js" */
/** @import { Robot, Warehouse } from "../station/robot.js" */
/** @import { Point, Target } from "./grid.js" */

import { carries, turnOf, wasDelivered } from "./goods.js";
import { ends, oneName } from "./grid.js";
import { titleOf } from "../parts/parcel.js";
import { crossing } from "../words/sentences.js";
import { blockedFor } from "./ways.js";
import { clock, say } from "../words/words.js";

/**
 * What a thing is, what a click on it does, and why a click does nothing; `act` is the click.
 *
 * @typedef {{ what?: string, does?: string | undefined, why?: string | undefined, act?: (() => unknown) | undefined }} Offer
 */

/** @typedef {{ beside: Element, said: HTMLElement }} Hand Where a person is asked and told. */
/** @typedef {{ kind: "good", id: string, hand: Hand }} Tile Goods that stand in a list. */

/**
 * @param {object} page
 * @param {Pick<Link, "warehouse" | "mayDrive">} page.link
 * @param {() => Robot | null} page.robot
 * @param {(product: string, hand?: Hand) => unknown} page.fetch orders goods, or asks whether they are back
 * @param {(crossing: string[]) => unknown} page.stands says where the robot stands
 * @param {() => boolean} page.isPlaceWanted whether that is to be said
 * @param {(way: string) => unknown} page.obstacle puts an obstacle there or takes it away
 * @param {() => boolean} page.isSetUp whether the map shows the warehouse that is set up
 * @param {() => Warehouse | null} page.edited that warehouse
 * @param {(target: Target) => Offer} page.setUp what a thing is and does then
 * @param {(goods: string[], at: Point) => unknown} page.choose lets a person choose among goods that stand there
 * @param {() => number} page.now
 * @param {() => boolean} page.isPast whether the map shows the past; `robot` is the past one then
 * @returns {(target: Target | Tile | null) => Offer}
 */
export function offers({ link, robot, fetch, choose, stands, isPlaceWanted, obstacle, isSetUp, edited, setUp, now, isPast }) {
  /** @param {string} id */
  const product = (id) => (isSetUp() ? edited() : link.warehouse)?.product?.find((product) => String(product.id) === id);

  /**
   * Goods are fetched; those that are not in their place, after a question.
   *
   * @param {string} id
   * @param {Hand} [hand] where a person is asked, if not on the map
   * @returns {Offer}
   */
  function good(id, hand) {
    const found = product(id);
    const what = say("tip_good", found ? titleOf(found) : id, found?.square.join(","));
    const shown = robot();
    if (!shown) return { what, why: say("no_robot") };
    const turn = turnOf(shown, id);
    if (carries(shown) === id) return { what, why: say("in_claw") };
    if (turn === 0) return { what, why: say("is_fetched") };
    if (turn > 0) return { what, why: say("waits_as", turn) };
    const why = cannot(shown);
    const act = why ? undefined : () => fetch(id, hand);
    if (shown.gone.has(id)) {
      const delivery = wasDelivered(shown, id);
      const was = delivery ? say("delivered_at", clock(delivery.at)) : say("away");
      return { what: `${what}, ${was}`, does: why ? undefined : say("does_ask_back"), why, act };
    }
    const after = shown.queue.filter(({ order }) => order !== shown.state.order).length;
    return { what, does: why ? undefined : after ? say("does_fetch_as", after + 1) : say("does_fetch"), why, act };
  }

  /**
   * Of goods that stand as one, one is chosen.
   *
   * @param {Point} at
   * @param {string} id
   * @returns {Offer}
   */
  function stack(at, id) {
    const ids = id.split(" ");
    const goods = ids.flatMap((one) => product(one) ?? []);
    return { what: say("tip_stack", goods[0]?.square.join(","), goods.map(titleOf).join(", ")), does: say("does_choose"), act: () => choose(ids, at) };
  }

  /**
   * A crossing is where the robot stands, while that is to be said.
   *
   * @param {string} id
   * @returns {Offer}
   */
  function node(id) {
    const what = say("tip_crossing", crossing(id));
    if (!isPlaceWanted()) return { what, why: say("place_how", say("where")) };
    const why = cannot(robot());
    return { what, does: why ? undefined : say("does_stand"), why, act: why ? undefined : () => stands(id.split(",")) };
  }

  /**
   * On a way of a simulated world an obstacle is put, or taken away.
   *
   * @param {string} id
   * @returns {Offer}
   */
  function way(id) {
    const shown = robot();
    const found = shown && [...shown.blocked.keys()].find((words) => oneName(words) === id);
    const since = found ? `, ${say("found_for", blockedFor(shown, found))}` : "";
    const what = say("tip_way", ...ends(id).map(crossing)) + since;
    const why = cannot(shown) ?? (shown?.truth ? undefined : say("real_floor"));
    if (why) return { what, why };
    const isThere = shown?.placed.some((words) => oneName(words) === id);
    return { what, does: say(isThere ? "does_take" : "does_put"), act: () => obstacle(id) };
  }

  /**
   * Why a robot is told nothing now.
   *
   * @param {Robot | null} shown
   */
  function cannot(shown) {
    if (!shown) return say("no_robot");
    if (!link.mayDrive) return say("viewer");
    return shown.isStale(now()) ? say("old") : undefined;
  }

  /**
   * What a thing is, what a click does, or why a click does nothing.
   *
   * @param {Target | Tile | null} target
   * @returns {Offer}
   */
  function offer(target) {
    if (!target) return { why: say("nothing_here") };
    if (target.kind === "stack") return stack(target.at, target.id);
    if (target.kind === "good") return good(target.id, "hand" in target ? target.hand : undefined);
    return target.kind === "crossing" ? node(target.id) : way(target.id);
  }

  return (target) => {
    // While the warehouse is set up or the map shows the past, nothing on it is ordered.
    if (isSetUp()) return !target || "hand" in target ? { why: say("set_up_how") } : target.kind === "stack" ? offer(target) : setUp(target);
    return isPast() ? { what: offer(target).what, why: say("past_orders") } : offer(target);
  };
}
