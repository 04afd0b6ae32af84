-- Who may sign in, and who is signed in. Passwords and secrets are kept as hashes only. Rows go when an account or a
-- sign-in ends; who made and ended them stands in `audit`.

CREATE TABLE users (
  name       TEXT PRIMARY KEY CHECK (length(name) BETWEEN 1 AND 32),
  role       TEXT NOT NULL CHECK (role IN ('viewer', 'operator', 'maintainer', 'admin')),
  password   TEXT NOT NULL CHECK (password LIKE '$argon2id$%'),
  made_at    TEXT NOT NULL,
  changed_at TEXT NOT NULL,  -- role or password
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('users', name, role, password, made_at, changed_at)) STORED
) STRICT;

-- A session, which somebody opened by a password or a console link, or a token, which a program carries.
CREATE TABLE credentials (
  id         INTEGER PRIMARY KEY AUTOINCREMENT,
  secret     TEXT NOT NULL UNIQUE CHECK (length(secret) = 64),  -- its SHA-256
  kind       TEXT NOT NULL CHECK (kind IN ('session', 'token')),
  user       TEXT REFERENCES users (name),  -- null: of a console link
  name       TEXT NOT NULL,                 -- of a token what it is for, of a console link which one
  role       TEXT NOT NULL CHECK (role IN ('viewer', 'operator', 'maintainer', 'admin')),  -- or the user's, if less
  made_at    TEXT NOT NULL,
  expires_at TEXT NOT NULL,
  checksum   INTEGER NOT NULL
             GENERATED ALWAYS AS (veneer_checksum('credentials', id, secret, kind, user, name, role, made_at,
               expires_at)) STORED,
  CHECK (user IS NOT NULL OR (kind = 'session' AND name <> '')),
  CHECK (kind = 'session' OR name <> '')
) STRICT;
CREATE INDEX credentials_of ON credentials (user);
CREATE UNIQUE INDEX tokens_have_names ON credentials (user, name) WHERE kind = 'token';

CREATE TRIGGER users_are_sound BEFORE UPDATE ON users
WHEN OLD.checksum <> veneer_checksum('users', OLD.name, OLD.role, OLD.password, OLD.made_at, OLD.changed_at)
BEGIN
  SELECT RAISE(ABORT, 'a row is damaged');
END;
CREATE TRIGGER users_are_removed_by_veneerd BEFORE DELETE ON users
WHEN veneer_writer() = 0
BEGIN
  SELECT RAISE(ABORT, 'only veneerd removes users');
END;
CREATE TRIGGER credentials_are_never_edited BEFORE UPDATE ON credentials
BEGIN
  SELECT RAISE(ABORT, 'a session or token is ended, never edited');
END;
CREATE TRIGGER credentials_are_removed_by_veneerd BEFORE DELETE ON credentials
WHEN veneer_writer() = 0
BEGIN
  SELECT RAISE(ABORT, 'only veneerd ends sessions and tokens');
END;
