// The view in which a warehouse is set up: the form, the same on the map, the names of goods, and which robots use it.

/** @import { Grip } from "../map/aim.js" */
/** @import { Target } from "../map/grid.js" */
/** @import { WarehouseMap } from "../map/map.js" */
/** @import { Link } from "../station/link.js" */
/** @import { Robot } from "../station/robot.js" */

import { at } from "../parts/at.js";
import { OnMap } from "./onmap.js";
import { Rename } from "./rename.js";
import { Setup } from "./setup.js";
import { Uses } from "./uses.js";

export class Editor {
  /**
   * @param {Link} link
   * @param {object} page
   * @param {WarehouseMap} page.map
   * @param {() => Robot | null} page.robot
   * @param {() => boolean} page.isOpen whether it is in view
   * @param {() => void} page.drawn is called whenever another warehouse is to be drawn
   */
  constructor(link, { map, robot, isOpen, drawn }) {
    this.setup = new Setup(link, {
      form: at("warehouse"), products: at("products"), add: at("add-product"), said: at("setup-said"), floor: at("floor-size"),
      undo: at("undo"), redo: at("redo"), undoes: at("undo-what"), unsaved: at("unsaved"), discard: at("discard"),
      saveFile: at("save-file"), loadFile: at("load-file"), mapString: at("map-string"), goodsString: at("goods-string"),
    }, { drawn, isOpen });
    const { edits } = this.setup;
    this.onMap = new OnMap(map, { edits, changed: () => this.setup.fill(), mayEdit: () => link.mayDrive });
    this.rename = new Rename(map, {
      form: at("rename"), number: at("rename-number"), name: at("rename-name"), move: at("rename-move"), remove: at("rename-remove"), close: at("rename-close"),
    }, this.onMap);
    this.uses = new Uses(link, {
      where: at("kept-where"), robots: at("kept-robots"), ask: at("renew"), box: at("renew-box"), question: at("renew-question"), yes: at("renew-yes"), no: at("renew-no"), said: at("renew-said"),
    }, robot);
    map.scaledAnew = () => this.onMap.draw(isOpen());
    link.addEventListener("warehouse", () => this.setup.kept(link.warehouse));
    if (link.warehouse) this.setup.kept(link.warehouse);
    at("setup-bar").inert = false;
  }

  /** The warehouse as it would become. */
  get now() {
    return this.setup.edits.now;
  }

  /** @param {Target} target */
  offers(target) {
    return this.rename.offers(target);
  }

  /**
   * What of the map the hand can take hold of.
   *
   * @param {Target} target
   * @returns {Grip | null}
   */
  grip(target) {
    return this.onMap.grip(target);
  }

  draw() {
    this.uses.draw();
  }

  /** Writes what changes with the language or with who looks. */
  words() {
    this.setup.draw();
  }

  close() {
    this.rename.close();
  }
}
