-- Schema 26: a row takes the place of another in no table. Rows that are kept refuse it as they refuse to be deleted;
-- these may be deleted by veneerd, so that INSERT OR REPLACE would have put another row in the place of one that is
-- there, without a word: a role or password that nobody gave, another reply under the key of a request that was done,
-- a plan that is not what people looked at.

CREATE TRIGGER users_are_never_replaced BEFORE INSERT ON users
WHEN EXISTS (SELECT 1 FROM users WHERE name = NEW.name)
BEGIN
  SELECT RAISE(ABORT, 'there is a user of this name');
END;
CREATE TRIGGER users_keep_their_name BEFORE UPDATE OF name, made_at ON users
BEGIN
  SELECT RAISE(ABORT, 'a user keeps the name');
END;
CREATE TRIGGER credentials_are_never_replaced BEFORE INSERT ON credentials
WHEN EXISTS (SELECT 1 FROM credentials WHERE id = NEW.id OR secret = NEW.secret)
  OR (NEW.kind = 'token' AND EXISTS (SELECT 1 FROM credentials WHERE user = NEW.user AND name = NEW.name AND
      kind = 'token'))
BEGIN
  SELECT RAISE(ABORT, 'there is such a session or token');
END;

CREATE TRIGGER recipes_are_never_replaced BEFORE INSERT ON recipes
WHEN EXISTS (SELECT 1 FROM recipes WHERE material = NEW.material AND operation = NEW.operation)
BEGIN
  SELECT RAISE(ABORT, 'there is a recipe for this');
END;
CREATE TRIGGER recipes_keep_what_they_are_for BEFORE UPDATE OF material, operation ON recipes
BEGIN
  SELECT RAISE(ABORT, 'a recipe stays one for its material and operation');
END;
CREATE TRIGGER request_keys_are_never_replaced BEFORE INSERT ON request_keys
WHEN EXISTS (SELECT 1 FROM request_keys WHERE who = NEW.who AND operation = NEW.operation AND key = NEW.key)
BEGIN
  SELECT RAISE(ABORT, 'a request was made under this key');
END;
CREATE TRIGGER request_keys_keep_their_request BEFORE UPDATE OF who, operation, key, request_hash, at ON request_keys
BEGIN
  SELECT RAISE(ABORT, 'a key stays its request''s');
END;
CREATE TRIGGER kept_cuts_are_never_replaced BEFORE INSERT ON kept_cuts
WHEN EXISTS (SELECT 1 FROM kept_cuts WHERE piece = NEW.piece)
BEGIN
  SELECT RAISE(ABORT, 'the cut of this piece is kept');
END;

CREATE TRIGGER plans_are_never_replaced BEFORE INSERT ON plans
WHEN EXISTS (SELECT 1 FROM plans WHERE id = NEW.id)
BEGIN
  SELECT RAISE(ABORT, 'there is a plan of this number');
END;
CREATE TRIGGER plan_panels_are_never_replaced BEFORE INSERT ON plan_panels
WHEN EXISTS (SELECT 1 FROM plan_panels WHERE plan = NEW.plan AND panel = NEW.panel)
BEGIN
  SELECT RAISE(ABORT, 'this plan was made on another map of the panel');
END;
CREATE TRIGGER patches_are_never_replaced BEFORE INSERT ON patches
WHEN EXISTS (SELECT 1 FROM patches WHERE id = NEW.id OR (plan = NEW.plan AND ordinal = NEW.ordinal) OR
  (plan = NEW.plan AND mark = NEW.mark))
BEGIN
  SELECT RAISE(ABORT, 'this plan has such a patch');
END;
CREATE TRIGGER placements_are_never_replaced BEFORE INSERT ON placements
WHEN EXISTS (SELECT 1 FROM placements WHERE id = NEW.id OR (plan = NEW.plan AND patch = NEW.patch))
BEGIN
  SELECT RAISE(ABORT, 'this plan has placed the patch');
END;
