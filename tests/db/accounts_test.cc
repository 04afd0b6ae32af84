// Users, sessions and tokens in the database.
#include "db/accounts.h"

#include <gmock/gmock.h>

#include "tests/db/cell_database.h"
#include "tests/db/stray_sql.h"

namespace veneer::db {
namespace {

using ::testing::IsEmpty;

class AccountsStore : public ::testing::Test {
 protected:
  CredentialRecord credential(char letter, const std::string& kind, std::optional<std::string> user,
                              const std::string& name) {
    return {std::string(64, letter), kind, std::move(user), name, "operator", kNow, kLater};
  }
  // The first letters of the secrets that are there.
  std::string there() {
    std::string out;
    for (const CredentialRecord& one : must(accounts.credentials())) out += one.secret.front();
    return out;
  }
  static UserRecord anna() { return {"anna", "operator", "$argon2id$v=19$x", kNow, kNow}; }
  CellDatabase cell;
  Accounts accounts{cell.database()};
};

TEST_F(AccountsStore, KeepsWhatItWasGiven) {
  VENEER_ASSERT_OK(accounts.add(anna()));
  VENEER_ASSERT_OK(accounts.add(credential('a', "token", "anna", "press room")));
  VENEER_ASSERT_OK(accounts.add(credential('b', "session", std::nullopt, "console link 1 of uid 1000")));
  const auto users = must(accounts.users());
  ASSERT_EQ(users.size(), 1U);
  EXPECT_EQ(users[0].password, "$argon2id$v=19$x");
  const auto signed_in = must(accounts.credentials());
  ASSERT_EQ(signed_in.size(), 2U);
  EXPECT_EQ(signed_in[0].user, "anna");
  EXPECT_EQ(signed_in[0].name, "press room");
  EXPECT_EQ(signed_in[0].expires_at, kLater);
  EXPECT_EQ(signed_in[1].user, std::nullopt);
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(AccountsStore, AChangeEndsSessionsAndARemovalEverything) {
  VENEER_ASSERT_OK(accounts.add(anna()));
  VENEER_ASSERT_OK(accounts.add(credential('a', "token", "anna", "press room")));
  VENEER_ASSERT_OK(accounts.add(credential('b', "session", "anna", "")));
  VENEER_ASSERT_OK(accounts.add(credential('c', "session", std::nullopt, "console link 1 of uid 1000")));
  UserRecord changed = anna();
  changed.role = "admin", changed.changed_at = kLater;
  VENEER_ASSERT_OK(accounts.change(changed));
  EXPECT_EQ(there(), "ac");
  EXPECT_EQ(must(accounts.users()).at(0).role, "admin");
  VENEER_ASSERT_OK(accounts.remove("anna"));
  EXPECT_EQ(there(), "c");
  EXPECT_THAT(must(accounts.users()), IsEmpty());
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

TEST_F(AccountsStore, RefusesWhatDoesNotFit) {
  VENEER_ASSERT_OK(accounts.add(anna()));
  EXPECT_EQ(accounts.add(anna()).error().code, ErrorCode::kConflict);
  UserRecord other = anna();
  other.name = "berta";
  EXPECT_EQ(accounts.change(other).error().code, ErrorCode::kNotFound);
  EXPECT_EQ(accounts.remove("berta").error().code, ErrorCode::kNotFound);
  EXPECT_EQ(accounts.add(credential('a', "token", "berta", "x")).error().code, ErrorCode::kNotFound);
  // A password as it was typed, an unknown role, a token that is nobody's.
  other.password = "walnut";
  EXPECT_FALSE(accounts.add(other).ok());
  other = anna(), other.name = "berta", other.role = "boss";
  EXPECT_FALSE(accounts.add(other).ok());
  EXPECT_FALSE(accounts.add(credential('a', "token", std::nullopt, "x")).ok());
  EXPECT_EQ(there(), "");
}

TEST_F(AccountsStore, ATokensNameIsItsOwnAmongItsUsers) {
  VENEER_ASSERT_OK(accounts.add(anna()));
  VENEER_ASSERT_OK(accounts.add(credential('a', "token", "anna", "press room")));
  EXPECT_EQ(accounts.add(credential('b', "token", "anna", "press room")).error().code, ErrorCode::kConflict);
  EXPECT_FALSE(execute(cell.database(),
                       "INSERT INTO credentials (secret, kind, user, name, role, made_at, expires_at) "
                       "SELECT replace(secret, 'a', 'c'), kind, user, name, role, made_at, expires_at "
                       "FROM credentials")
                   .ok());
  for (const char letter : {'d', 'e'}) VENEER_ASSERT_OK(accounts.add(credential(letter, "session", "anna", "")));
  EXPECT_EQ(there(), "ade");
}

TEST_F(AccountsStore, EndsTheOnesThatAreNamedOrAll) {
  for (const char letter : {'a', 'b', 'c'})
    VENEER_ASSERT_OK(accounts.add(credential(letter, "session", std::nullopt, "console link 1 of uid 1000")));
  VENEER_ASSERT_OK(accounts.end({std::string(64, 'b'), std::string(64, 'z')}));
  EXPECT_EQ(there(), "ac");
  VENEER_ASSERT_OK(accounts.end_all());
  EXPECT_EQ(there(), "");
}

// A row in another's place would be a role or a password that nobody gave.
TEST_F(AccountsStore, NoRowTakesThePlaceOfAnotherBehindTheStoresBack) {
  VENEER_ASSERT_OK(accounts.add(anna()));
  VENEER_ASSERT_OK(accounts.add(credential('a', "token", "anna", "press room")));
  const std::string user =
      "INSERT OR REPLACE INTO users (name, role, password, made_at, changed_at) "
      "SELECT name, 'admin', password, made_at, changed_at FROM users";
  const std::string token =
      "INSERT OR REPLACE INTO credentials (id, secret, kind, user, name, role, made_at, expires_at) "
      "SELECT id, secret, kind, user, name, 'admin', made_at, expires_at FROM credentials";
  for (const std::string& statement : {user, token, std::string("UPDATE OR REPLACE credentials SET role = 'admin'")}) {
    EXPECT_NE(stray(cell.file(), statement), "") << "from the shell: " << statement;
    EXPECT_THROW(cell.database().connection().exec(statement), SQLite::Exception) << "outside a store: " << statement;
  }
  // Within a store's transaction too, whichever key the row would take: the number, the secret, the token's name.
  VENEER_ASSERT_OK(accounts.add([] {
    UserRecord berta = anna();
    berta.name = "berta", berta.role = "viewer";
    return berta;
  }()));
  const std::string columns =
      "INSERT OR REPLACE INTO credentials (secret, kind, user, name, role, made_at, expires_at) ";
  for (const std::string& statement :
       {user, token, columns + "SELECT secret, 'session', user, '', 'admin', made_at, expires_at FROM credentials",
        columns + "SELECT replace(secret, 'a', 'c'), kind, user, name, 'admin', made_at, expires_at FROM credentials",
        std::string("UPDATE OR REPLACE credentials SET role = 'admin'"),
        std::string("UPDATE OR REPLACE users SET name = 'anna' WHERE name = 'berta'")}) {
    const Status done = execute(cell.database(), statement);
    ASSERT_FALSE(done.ok()) << statement;
    EXPECT_EQ(done.error().code, ErrorCode::kConflict) << done.error().message;
  }
  EXPECT_EQ(must(accounts.users()).at(0).role, "operator");
  EXPECT_EQ(must(accounts.credentials()).at(0).role, "operator");
  VENEER_EXPECT_OK(cell.database().check_integrity());
}

}  // namespace
}  // namespace veneer::db
