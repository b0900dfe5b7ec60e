// What the things on the map are, and what a click on one does now: the one place for tip and click.

import { carries, turnOf, wasDelivered } from "./goods.js";
import { ends, oneName } from "./grid.js";
import { crossing } from "../words/sentences.js";
import { blockedFor } from "./ways.js";
import { clock, say } from "../words/words.js";

/**
 * `link` and `robot` as everywhere. `fetch` orders goods or asks whether they are back, `stands` says where the robot
 * stands, `obstacle` puts or takes one, `setUp` offers what is set up; `isPlaceWanted` and `now` as named.
 */
export function offers({ link, robot, fetch, stands, isPlaceWanted, obstacle, setUp, isSetUp, now }) {
  const of = {
    /** Goods are fetched; those that are not in their place, after a question. */
    good({ id }) {
      const { name, square } = link.warehouse.product.find((product) => String(product.id) === id);
      const what = say("tip_good", name ? `${id} ${name}` : id, square.join(","));
      const shown = robot();
      if (!shown) return { what, why: say("no_robot") };
      const turn = turnOf(shown, id);
      if (carries(shown) === id) return { what, why: say("in_claw") };
      if (turn === 0) return { what, why: say("is_fetched") };
      if (turn > 0) return { what, why: say("waits_as", turn) };
      const why = cannot(shown);
      const act = why ? undefined : () => fetch(id);
      if (shown.gone.has(id)) {
        const delivery = wasDelivered(shown, id);
        const was = delivery ? say("delivered_at", clock(delivery.at)) : say("away");
        return { what: `${what}, ${was}`, does: why ? undefined : say("does_ask_back"), why, act };
      }
      const after = shown.queue.filter(({ order }) => order !== shown.state.order).length;
      return { what, does: why ? undefined : after ? say("does_fetch_as", after + 1) : say("does_fetch"), why, act };
    },

    /** A crossing is where the robot stands, while that is to be said. */
    crossing({ id }) {
      const what = say("tip_crossing", crossing(id));
      if (!isPlaceWanted()) return { what, why: say("place_how", say("where")) };
      const why = cannot(robot());
      return { what, does: why ? undefined : say("does_stand"), why, act: why ? undefined : () => stands(id.split(",")) };
    },

    /** On a way of a simulated world an obstacle is put, or taken away. */
    way({ id }) {
      const shown = robot();
      const found = shown && [...shown.blocked.keys()].find((words) => oneName(words) === id);
      const since = found ? `, ${say("found_for", blockedFor(shown, found))}` : "";
      const what = say("tip_way", ...ends(id).map(crossing)) + since;
      const why = cannot(shown) ?? (shown.truth ? undefined : say("real_floor"));
      if (why) return { what, why };
      const isThere = shown.placed.some((words) => oneName(words) === id);
      return { what, does: say(isThere ? "does_take" : "does_put"), act: () => obstacle(id) };
    },
  };

  /** Why a robot is told nothing now. */
  function cannot(shown) {
    if (!shown) return say("no_robot");
    if (!link.mayDrive) return say("viewer");
    return shown.isStale(now()) ? say("old") : undefined;
  }

  /** What it is, what a click does, or why a click does nothing. */
  return (target) => {
    // Nothing is ordered meanwhile.
    if (isSetUp()) return target ? setUp(target) : { why: say("set_up_how") };
    return target ? of[target.kind](target) : { why: say("nothing_here") };
  };
}
