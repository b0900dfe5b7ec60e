// Obstacles of a simulated world: a click on a way puts one there or takes it away, and can be undone.

/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { reason } from "../words/sentences.js";
import { put, say } from "../words/words.js";

/**
 * What a click on a way does.
 *
 * @param {Link} link
 * @param {{ said: HTMLElement, undo: HTMLElement }} parts
 * @param {() => Robot | null} robot
 * @returns {(way: string) => Promise<void>}
 */
export function obstacles(link, { said, undo }, robot) {
  return async (way) => {
    const shown = robot();
    if (!shown) return;
    // Where one stands a second put changes nothing, so it is tried to be taken first.
    const take = await link.act(shown, `obstacle take ${way}`);
    const answer = take.done ? take : await link.act(shown, `obstacle put ${way}`);
    if (answer.refused) return put(said, reason(answer.refused));
    put(said, say(take.done ? "obstacle_taken" : "obstacle_put"));
    undo.toggleAttribute("hidden", false);
    undo.onclick = async () => {
      undo.toggleAttribute("hidden", true);
      const back = await link.act(shown, `obstacle ${take.done ? "put" : "take"} ${way}`);
      put(said, back.refused ? reason(back.refused) : say(take.done ? "obstacle_put" : "obstacle_taken"));
    };
  };
}
