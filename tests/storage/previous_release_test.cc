// The previous release's statements on the newest schema (CONTRIBUTING.md, migrations): while a plant changes over, processes of
// both run on it. tests/storage/statements/ holds what the previous release sends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "storage/database.h"
#include "tests/support/throwaway_database.h"

namespace sixpoint::storage {
namespace {

using sixpoint::testing::Soon;
using sixpoint::testing::ThrowawayDatabase;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Statement {
  std::string name;  // file and constant
  std::string sql;
};

// A comment line with the name, then the statement on a line of its own.
std::vector<Statement> Read(const std::filesystem::path& path) {
  std::vector<Statement> statements;
  std::ifstream file(path);
  std::string name;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("-- ", 0) == 0)
      name = line.substr(3);
    else
      statements.push_back({name, line.substr(0, line.size() - 1)});
  }
  return statements;
}

std::vector<Statement> PreviousRelease() {
  const char* root = std::getenv("SIXPOINT_SOURCE_DIR");
  std::vector<Statement> all;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::string(root == nullptr ? "." : root) + "/tests/storage/statements"))
    if (entry.path().extension() == ".sql")
      for (Statement& statement : Read(entry.path())) all.push_back(std::move(statement));
  return all;
}

class PreviousReleaseTest : public ::testing::Test {
 protected:
  absl::StatusOr<Rows> Ask(const std::string& sql, const Params& params = {}) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    if (!transaction.ok()) return transaction.status();
    absl::StatusOr<Rows> rows = transaction->Execute(sql, params);
    if (!rows.ok()) return rows;
    if (absl::Status committed = transaction->Commit(); !committed.ok()) return committed;
    return rows;
  }
  void Change(const std::string& sql) { ASSERT_TRUE(Ask(sql).ok()) << Ask(sql).status(); }

  // Columns that an INSERT of that table must give.
  std::set<std::string> RequiredColumns(const std::string& table) {
    const absl::StatusOr<Rows> rows = Ask(
        "SELECT column_name::text FROM information_schema.columns WHERE table_schema = 'public' AND table_name = $1 "
        "AND is_nullable = 'NO' AND column_default IS NULL AND is_identity = 'NO' AND is_generated = 'NEVER'",
        Params().Text(table));
    EXPECT_TRUE(rows.ok()) << rows.status();
    std::set<std::string> required;
    for (int row = 0; rows.ok() && row < rows->count(); ++row) required.insert(rows->Text(row, 0));
    return required;
  }

  // Parsed and planned, never run: names, types, and the indexes that ON CONFLICT asks for.
  absl::Status Plan(const std::string& sql) {
    absl::StatusOr<Transaction> transaction = database_.database()->Begin(Soon());
    if (!transaction.ok()) return transaction.status();
    for (const std::string& step :
         {std::string("DEALLOCATE ALL"), std::string("SET LOCAL plan_cache_mode = force_generic_plan"),
          "PREPARE previous AS " + sql})
      if (const absl::StatusOr<Rows> done = transaction->Execute(step); !done.ok()) return done.status();
    const absl::StatusOr<Rows> parameters =
        transaction->Execute("SELECT cardinality(parameter_types) FROM pg_prepared_statements WHERE name = 'previous'");
    if (!parameters.ok()) return parameters.status();
    std::string values;
    for (std::int64_t i = 0; i < parameters->Int(0, 0); ++i) values += i == 0 ? "(NULL" : ", NULL";
    return transaction->Execute("EXPLAIN EXECUTE previous " + values + (values.empty() ? "" : ")")).status();
  }

  // What the newest schema would refuse of the statement; empty: nothing.
  std::string Complaint(const Statement& statement) {
    if (const absl::Status planned = Plan(statement.sql); !planned.ok())
      return statement.name + ": " + std::string(planned.message());
    static const std::regex kInsert("INSERT INTO (\\w+) \\(([^)]*)\\)");
    std::string complaint;
    for (std::sregex_iterator at(statement.sql.begin(), statement.sql.end(), kInsert), end; at != end; ++at) {
      const std::string given = "," + std::regex_replace((*at)[2].str(), std::regex("\\s+"), "") + ",";
      for (const std::string& column : RequiredColumns((*at)[1]))
        if (given.find("," + column + ",") == std::string::npos)
          complaint += statement.name + ": " + (*at)[1].str() + "." + column + " is required and not given";
    }
    return complaint;
  }
  std::vector<std::string> Complaints() {
    std::vector<std::string> complaints;
    for (const Statement& statement : PreviousRelease())
      if (const std::string complaint = Complaint(statement); !complaint.empty()) complaints.push_back(complaint);
    return complaints;
  }

  ThrowawayDatabase database_;
};

TEST_F(PreviousReleaseTest, ItsStatementsStandOnTheNewestSchema) {
  const std::vector<Statement> statements = PreviousRelease();
  // Every aggregate is in it.
  EXPECT_GT(statements.size(), 100u);
  EXPECT_GT(std::count_if(statements.begin(), statements.end(),
                          [](const Statement& s) { return s.sql.find("INSERT INTO ") != std::string::npos; }),
            30);
  EXPECT_THAT(Complaints(), IsEmpty());
}

TEST_F(PreviousReleaseTest, WhatIsAddedHarmsNothing) {
  Change("ALTER TABLE scan_deletions ADD COLUMN note text, ADD COLUMN count integer NOT NULL DEFAULT 0");
  Change("CREATE TABLE more (id integer PRIMARY KEY)");
  EXPECT_THAT(Complaints(), IsEmpty());
}

TEST_F(PreviousReleaseTest, ARenamedColumnIsSeen) {
  Change("ALTER TABLE scan_deletions RENAME COLUMN reason TO why");
  const std::vector<std::string> complaints = Complaints();
  ASSERT_FALSE(complaints.empty());
  for (const std::string& complaint : complaints) EXPECT_THAT(complaint, HasSubstr("reason"));
}

TEST_F(PreviousReleaseTest, AColumnThatIsNowRequiredIsSeen) {
  Change("ALTER TABLE scan_deletions ADD COLUMN note text NOT NULL");
  EXPECT_THAT(Complaints(), ElementsAre(HasSubstr("kInsertDeletion: scan_deletions.note is required and not given")));
}

TEST_F(PreviousReleaseTest, AnIndexThatAConflictAsksForIsSeen) {
  Change("ALTER TABLE blobs DROP CONSTRAINT blobs_pk CASCADE");
  EXPECT_THAT(Complaints(), Contains(HasSubstr("ON CONFLICT")));
}

}  // namespace
}  // namespace sixpoint::storage
