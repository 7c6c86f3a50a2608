#include "bench/record/tampering.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>
#include <vector>

#include "bench/ground/transactions.h"
#include "ledger/audit.h"
#include "services/plant/ledger_service.h"
#include "storage/ledger.h"
#include "tests/support/in_process_server.h"
#include "tests/support/tamperings.h"

namespace sixpoint::bench {
namespace {

using plant::v1::LedgerService;
using testing::Tampering;

constexpr int kBlades = 30;  // some 270 entries: subtrees are kept from 256 on

// A statement that may not run inside a transaction block: ended by hand before it.
void Administer(const std::string& conninfo, const std::string& sql) {
  const auto database = storage::Database::Open(conninfo + " dbname=postgres", 1);
  storage::Transaction transaction = Begin(database.get());
  Must(transaction.Execute("ROLLBACK"));
  Must(transaction.Execute(sql));
}

// By which tables a check says that something is not as it was; "heads" for what the heads say.
std::set<std::string> Check(storage::Database* database, const std::vector<ledger::Head>& sent, const std::string& key,
                            std::int64_t* leaves) {
  const storage::PlantStores stores = storage::PlantIn(database);
  plant::LedgerService service(storage::LedgerIn(database), stores.blades, stores.clearances, nullptr);
  testing::InProcessServer server({&service});
  const auto stub = LedgerService::NewStub(server.Connect());
  ledger::Audit audit(sent, key);
  std::set<std::string> tables;
  grpc::ClientContext context;
  plant::v1::VerifyLedgerRequest request;
  request.set_with_blobs(!sent.empty());
  const auto reader = stub->VerifyLedger(&context, request);
  for (plant::v1::LedgerSlice slice; reader->Read(&slice);) {
    std::vector<ledger::Hash> hashes;
    for (std::size_t at = 0; at < slice.leaf_hashes().size(); at += 32)
      hashes.push_back(slice.leaf_hashes().substr(at, 32));
    for (const plant::v1::LedgerHead& head : slice.heads()) {
      ledger::Head shown = sent.empty() ? ledger::Head() : sent.front();
      shown.tree_size = head.tree_size();
      shown.root = head.root_sha256();
      shown.record_sequence = head.record_sequence();
      shown.key_id = head.key_id();
      shown.signature = head.signature();
      audit.AddHead(shown);
    }
    audit.AddLeaves(hashes);
    for (const plant::v1::LedgerDamage& damage : slice.damages()) tables.insert(damage.table());
  }
  const grpc::Status ended = reader->Finish();
  if (!ended.ok()) {
    std::fprintf(stderr, "check: %s\n", ended.error_message().c_str());
    std::exit(2);
  }
  audit.Finish();
  if (!audit.findings().empty()) tables.insert("heads");
  *leaves = audit.size();
  return tables;
}

template <typename Work>
double Seconds(const Work& work) {
  const auto began = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

}  // namespace

nlohmann::json TamperWithAll(const std::string& conninfo) {
  const ledger::SigningKey key = Must(ledger::SigningKey::OfPem(Must(ledger::SigningKey::NewPem())));
  std::string name;
  std::vector<ledger::Head> sent;
  {
    const auto database = storage::Database::Open(conninfo, 4);
    storage::Transaction transaction = Begin(database.get());
    name = Must(transaction.Execute("SELECT current_database()")).Text(0, 0);
    Commit(&transaction);
    sent = testing::AddTamperedPlant(database.get(), key, kBlades);
  }
  nlohmann::json told = {{"kinds", nlohmann::json::array()}};
  const auto on_copy = [&](const Tampering* tampering) {
    Administer(conninfo, "CREATE DATABASE tampered TEMPLATE " + name);
    std::set<std::string> tables;
    {
      const auto owner = storage::Database::Open(conninfo + " dbname=tampered", 1);
      if (tampering != nullptr) {
        storage::Transaction transaction = Begin(owner.get());
        Must(absl::StatusOr<int>(testing::Tamper(transaction, *tampering).ok() ? absl::StatusOr<int>(0)
                                                                               : absl::InternalError(tampering->what)));
        Commit(&transaction);
      }
      const auto service = storage::Database::Open(conninfo + " dbname=tampered user=sixpoint_plant", 2);
      std::int64_t leaves = 0;
      tables = Check(service.get(), sent, key.public_pem(), &leaves);
    }
    Administer(conninfo, "DROP DATABASE tampered WITH (FORCE)");
    return tables;
  };
  told["false_alarms"] = on_copy(nullptr).size();
  for (const Tampering& tampering : testing::Tamperings())
    told["kinds"].push_back({{"what", tampering.what}, {"found", on_copy(&tampering).count(tampering.table) > 0}});
  return told;
}

nlohmann::json SealAndVerify(const std::string& conninfo) {
  const auto owner = storage::Database::Open(conninfo, 2);
  const auto service = storage::Database::Open(conninfo + " user=sixpoint_plant", 2);
  plant::LedgerSealerOptions options;
  options.every = std::chrono::milliseconds(0);
  plant::LedgerSealer sealer(options, storage::LedgerIn(storage::Database::Open(conninfo + " user=sixpoint_plant", 1)),
                             std::nullopt);
  const double seal_s =
      Seconds([&] { Must(sealer.SealAll().ok() ? absl::StatusOr<int>(0) : absl::InternalError("not sealed")); });
  std::int64_t leaves = 0;
  bool is_well = false;
  std::vector<double> verify_s, sql_s;
  for (int round = 0; round < 3; ++round) {
    verify_s.push_back(Seconds([&] { is_well = Check(service.get(), {}, "", &leaves).empty(); }));
    sql_s.push_back(Seconds([&] {
      storage::Transaction transaction = Begin(owner.get());
      for (const storage::LedgerTable& table : storage::LedgerTables())
        Must(transaction.Execute(std::string("SELECT sum(octet_length(t::text)) FROM public.") + table.name + " t"));
    }));
  }
  std::sort(verify_s.begin(), verify_s.end());
  std::sort(sql_s.begin(), sql_s.end());
  storage::Transaction transaction = Begin(owner.get());
  const storage::Rows sizes = Must(
      transaction.Execute("SELECT pg_total_relation_size('ledger_leaves') + pg_total_relation_size('ledger_nodes'), "
                          "pg_total_relation_size('ledger_contents')"));
  Must(storage::BeginLedger(transaction).ok() ? absl::StatusOr<int>(0) : absl::InternalError("no ledger"));
  constexpr int kPaths = 200;
  const double paths_s = Seconds([&] {
    for (int i = 0; i < kPaths; ++i) Must(storage::PathOf(transaction, leaves * i / kPaths, leaves));
  });
  return {{"entries", leaves},
          {"is_well", is_well},
          {"seal_s", seal_s},
          {"verify_s", verify_s[1]},
          {"sql_s", sql_s[1]},
          {"path_s", paths_s / kPaths},
          {"kept_bytes", sizes.Int(0, 0)},
          {"month_bytes", sizes.Int(0, 1)}};
}

}  // namespace sixpoint::bench
