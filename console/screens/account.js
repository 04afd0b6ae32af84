// Who one is here: signing in and out, one's own password; for admins everybody's accounts and tokens.
import {h} from "../dom.js";
import {dayTime, t} from "../words.js";
import {changed, mayDo, model} from "../model.js";
import {command, showRefusal} from "../commands.js";
import {button, card, empty, fact, facts, hint} from "../parts.js";
import {beginAnew, get, kAgainMs, signIn, signOut} from "../link.js";
import {faultOf, numberField, numberOf} from "../fields.js";

const kRoles = ["viewer", "operator", "maintainer", "admin"];
let users = [], tokens = [], loaded = false;
let days = "90";      // of the next token
const kDays = {least: 1, most: 3650, whole: true};
let madeToken = "";  // shown until the screen is left
let told = "";       // what was done last

const signedIn = () => Boolean(model.session.expires_at);

export function enter() {
  madeToken = told = "";
  loaded = false;
  changed();
}

async function load() {
  try {
    users = (await get("/users")).users;
    tokens = (await get("/tokens")).tokens;
  } catch (fault) {
    showRefusal(fault.message);
    setTimeout(() => { loaded = false; changed(); }, kAgainMs);
  }
  changed();
}

export function draw() {
  if (mayDo("admin") && !loaded) { loaded = true; load(); }
  const own = [signedIn() ? whoCard() : signInCard(), model.session.user && passwordCard()];
  if (!mayDo("admin")) return h("div.column.account", {}, ...own);
  return h("div.columns.two.account", {}, h("div.column", {}, usersCard(), addCard(), tokensCard()), h("div.column", {}, ...own));
}

// ---- oneself --------------------------------------------------------------------------------------------------------

const field = (name, label, more = {}) => h("label", {}, label, h("input", {type: "text", name, required: true, autocapitalize: "none", spellcheck: "false", ...more}));
const secret = (name, label, autocomplete) => field(name, label, {type: "password", autocomplete, minlength: autocomplete === "new-password" ? 8 : null});
// The choice is the page's own, and no redrawing changes it: `first` is only where it begins.
const roleField = (first, more = {}) => h("label", {}, t("account.role"), h("select", {name: "role", ...more}, ...kRoles.map((role) => h("option", {value: role, selected: role === first}, t(`role_name.${role}`)))));
const submit = (label, id) => h("div.commands", {}, h("button.wide", {type: "submit", id}, label));

// What a form says, by the names of its fields.
function taken(event) {
  event.preventDefault();
  return Object.fromEntries(new FormData(event.target));
}

function signInCard() {
  if (!model.session.accounts) return card(t("account.sign_in"), h("p", {}, t("account.none_yet")));
  return card(t("account.sign_in"),
    h("form.form", {onsubmit: enterName},
      field("user", t("account.name"), {autocomplete: "username", id: "sign-in-name"}),
      secret("password", t("account.password"), "current-password"),
      submit(t("account.sign_in"), "do-sign-in")),
    hint(t("account.link")));
}

async function enterName(event) {
  const {user, password} = taken(event);
  showRefusal("");
  try { await signIn(user, password); } catch (fault) { showRefusal(fault.message); }
}

function whoCard() {
  const {who, role, expires_at: until} = model.session;
  return card(t("account.who"),
    facts(fact(t("account.you"), who), fact(t("account.role"), t(`role_name.${role}`)), fact(t("account.until"), dayTime(until))),
    hint(t(`role_may.${role}`)),
    h("div.commands", {}, button(t("account.sign_out"), leave, {wide: true, id: "do-sign-out"})));
}

async function leave() {
  try { await signOut(); } catch (fault) { showRefusal(fault.message); }
}

function passwordCard() {
  return card(t("account.new_password"),
    h("form.form", {onsubmit: changeOwn},
      secret("old", t("account.old_password"), "current-password"),
      secret("password", t("account.new_password"), "new-password"),
      submit(t("account.change"), "do-password")),
    hint(t("account.change_ends")));
}

async function changeOwn(event) {
  const form = event.target;
  if (await command("/session/password", {body: taken(event)})) { form.reset(); beginAnew(); }
}

// ---- everybody ------------------------------------------------------------------------------------------------------

async function done(reply, sentence) {
  if (reply) told = sentence;
  await load();
  return reply;
}

function usersCard() {
  const row = ({name, role}) => h("li", {"data-key": `user-${name}`},
    h("div", {}, h("b", {}, name)),
    h("select", {value: role, "aria-label": t("account.role_of", {name}), onchange: (event) => give(name, event.target.value)},
      ...kRoles.map((one) => h("option", {value: one}, t(`role_name.${one}`)))),
    button(t("account.remove"), () => remove(name)),
    h("details.renew", {"data-key": `renew-${name}`}, h("summary", {}, t("account.new_password")),
      h("form.form", {onsubmit: (event) => renew(event, name)}, secret("password", t("account.new_password"), "new-password"), submit(t("account.change"), `renew-${name}`))));
  return card(t("account.users"),
    told && h("p.hint", {role: "status"}, told),
    users.length ? h("ul.list", {}, ...users.map(row)) : empty(t("account.no_users")));
}

const give = async (name, role) => done(await command(`/users/${name}/role`, {body: {role}}), t("account.role_given", {name, role: t(`role_name.${role}`)}));

async function remove(name) {
  if (confirm(t("account.remove_sure", {name}))) await done(await command(`/users/${name}`, {method: "DELETE"}), t("account.removed", {name}));
}

async function renew(event, name) {
  const form = event.target;
  if (await done(await command(`/users/${name}/password`, {body: taken(event)}), t("account.renewed", {name}))) form.reset();
}

function addCard() {
  return card(t("account.add"),
    h("form.form", {onsubmit: add},
      field("name", t("account.name"), {autocomplete: "off", pattern: "[a-z][a-z0-9._\\-]{0,31}", title: t("account.name_rule"), id: "new-user"}),
      roleField("operator", {id: "new-role"}),
      secret("password", t("account.password"), "new-password"),
      submit(t("account.add"), "do-add-user")),
    hint(`${t("account.name_rule")} ${t("account.password_rule")}`));
}

async function add(event) {
  const form = event.target, {name, role, password} = taken(event);
  if (await done(await command(`/users/${name}`, {body: {role, password}}), t("account.added", {name, role: t(`role_name.${role}`)}))) form.reset();
}

function tokensCard() {
  const row = ({user, name, role, expires_at: until}) => h("li", {"data-key": `token-${user}-${name}`},
    h("div", {}, h("b", {}, name), " ", h("small", {}, t("account.token_of", {user, role: t(`role_name.${role}`), until: dayTime(until)}))),
    button(t("account.revoke"), async () => done(await command(`/users/${user}/tokens/${encodeURIComponent(name)}`, {method: "DELETE"}), t("account.revoked", {name}))));
  return card(t("account.tokens"),
    h("p.dim", {}, t("account.tokens_are")),
    tokens.length ? h("ul.list", {}, ...tokens.map(row)) : null,
    madeToken && h("p.note", {role: "status"}, t("account.token_once"), " ", h("code", {}, madeToken)),
    users.length ? h("details", {}, h("summary", {}, t("account.new_token")),
      h("form.form", {onsubmit: addToken},
        h("label", {}, t("account.token_whose"), h("select", {name: "user"}, ...users.map(({name}) => h("option", {value: name}, name)))),
        field("token", t("account.token_for"), {autocomplete: "off", maxlength: 64}),
        roleField("viewer"),
        numberField(t("account.token_days"), days, (text) => { days = text; changed(); }, {...kDays, name: "days"}),
        submit(t("account.new_token"), "do-new-token"))) : null);
}

async function addToken(event) {
  const form = event.target, {user, token, role} = taken(event);
  if (faultOf(days, kDays)) return;  // it says so itself
  const made = await command(`/users/${user}/tokens/${encodeURIComponent(token)}`, {body: {role, days: numberOf(days)}});
  madeToken = made ? made.token : "";
  if (await done(made, "")) form.reset();
}
