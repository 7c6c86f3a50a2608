#include <algorithm>
#include <map>
#include <thread>
#include <vector>

#include "bench/ground/blade_rows.h"
#include "bench/ground/runs.h"
#include "bench/ground/transactions.h"

namespace sixpoint::bench {
namespace {

// By table, partitions together.
constexpr char kUse[] =
    "SELECT coalesce(p.relname, c.relname), p.oid IS NULL, sum(c.reltuples)::bigint, "
    "sum(pg_total_relation_size(c.oid))::bigint, sum(pg_indexes_size(c.oid))::bigint FROM pg_class c "
    "LEFT JOIN pg_inherits i ON i.inhrelid = c.oid LEFT JOIN pg_class p ON p.oid = i.inhparent "
    "WHERE c.relkind = 'r' AND c.relnamespace = 'public'::regnamespace GROUP BY 1, 2";

struct Use {
  bool whole = false;
  double rows = 0, bytes = 0, index_bytes = 0;
};

std::map<std::string, Use> UseOf(storage::Database* database) {
  storage::Transaction transaction = Begin(database);
  Must(transaction.Execute("ANALYZE"));
  const storage::Rows rows = Must(transaction.Execute(kUse));
  std::map<std::string, Use> uses;
  for (int row = 0; row < rows.count(); ++row)
    uses[rows.Text(row, 0)] = {rows.Bool(row, 1), static_cast<double>(std::max<std::int64_t>(0, rows.Int(row, 2))),
                               static_cast<double>(rows.Int(row, 3)), static_cast<double>(rows.Int(row, 4))};
  return uses;
}

}  // namespace

nlohmann::json MeasureSizes(const std::string& conninfo, int blade_count) {
  const auto database = storage::Database::Open(conninfo, 2);
  const Registry registry = MakeRegistry(database.get());
  const std::map<std::string, Use> before = UseOf(database.get());
  // Two at once: rows of several blades lie among each other, as in a plant.
  std::vector<std::thread> writers;
  for (int writer = 0; writer < 2; ++writer)
    writers.emplace_back([&, writer] {
      for (int i = writer; i < blade_count; i += 2)
        AddBlade(database.get(), registry, "SN-2026-" + std::to_string(1'000'000 + i));
    });
  for (std::thread& writer : writers) writer.join();
  nlohmann::json tables = nlohmann::json::array();
  Use sum;
  double whole_bytes = 0;
  for (const auto& [name, after] : UseOf(database.get())) {
    const auto known = before.find(name);
    const Use old = known == before.end() ? Use() : known->second;
    const Use use{after.whole, (after.rows - old.rows) / blade_count, (after.bytes - old.bytes) / blade_count,
                  (after.index_bytes - old.index_bytes) / blade_count};
    if (use.rows < 0.5) continue;
    tables.push_back({{"name", name}, {"rows", use.rows}, {"bytes", use.bytes}, {"index_bytes", use.index_bytes}});
    sum.rows += use.rows;
    sum.bytes += use.bytes;
    if (use.whole) whole_bytes += use.bytes;
  }
  return {{"tables", tables}, {"rows", sum.rows}, {"bytes", sum.bytes}, {"whole_bytes", whole_bytes}};
}

}  // namespace sixpoint::bench
