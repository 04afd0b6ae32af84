// What is confirmed by name before a pattern is burnt: the test card, the board that is measured by. A tick is good for
// one burn, of what lies there now.
import {h} from "./dom.js";
import {asSentence, t} from "./words.js";
import {changed, followStatus, model} from "./model.js";

const kScrap = "scrap on the bed";  // by its name in the API; asked for where wood of the stock may lie there unseen

// `more` gives the names of what is asked besides, and `must` those of them without which nothing is burnt.
export function burnTicks(key, more = () => [], must = () => []) {
  const given = new Set();
  let of = "";
  const asked = () => [...((model.cell && model.cell.confirm) || []), ...must()];
  const names = () => [...new Set([...asked(), ...more(), ...(model.panels.length ? [kScrap] : [])])];

  // Another state, lid, picture of the bed or list of names asks again.
  function renew() {
    const {state, lid} = model.cell || {};
    const now = JSON.stringify([names(), state, lid, model.bedLooks]);
    if (now === of) return;
    of = now;
    given.clear();
  }
  followStatus(renew);  // also while another screen is shown, or none

  function tick(name, is) {
    renew();
    if (is) given.add(name); else given.delete(name);
    changed();
  }

  return {
    ready() { renew(); return asked().every((name) => given.has(name)); },
    // What is ticked of what is asked now; none of it is for another burn.
    take() {
      renew();
      const ticked = names().filter((name) => given.has(name));
      given.clear();
      changed();
      return ticked;
    },
    list() {
      renew();
      return names().length > 0 && h("fieldset.confirm", {"data-key": key}, h("legend", {}, t("confirm")), ...names().map((name) => h("label", {"data-key": name},
        h("input", {type: "checkbox", checked: given.has(name), onchange: (event) => tick(name, event.target.checked)}), asSentence(name).replace(/\.$/, ""))));
    },
  };
}
