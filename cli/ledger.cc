// `sixpoint ledger`: heads, the check of the whole ledger against heads from elsewhere, and the proof of one blade as a file.
#include <ctime>
#include <iostream>

#include "cli/commands.h"
#include "cli/document.h"
#include "cli/out_file.h"
#include "ledger/audit.h"
#include "services/runtime/call.h"
#include "sixpoint/plant/v1/ledger.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using nlohmann::ordered_json;
using plant::v1::LedgerService;

constexpr int kMostDamageLines = 200;  // of damages that people read; --json has all that are kept
constexpr std::size_t kMostDamages = 100'000;

ledger::Head HeadOf(const plant::v1::LedgerHead& head) {
  const std::time_t seconds = head.signed_at().seconds();
  std::tm utc{};
  char text[32] = "";
  if (gmtime_r(&seconds, &utc) != nullptr) std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return {head.plant_id(), head.tree_size(), head.root_sha256(), head.record_sequence(), text,
          head.key_id(),   head.signature()};
}

absl::Status ShowHead(Session* session) {
  plant::v1::LedgerHead head;
  if (absl::Status status = session->Call<LedgerService>("plant", &LedgerService::Stub::GetLedgerHead,
                                                         plant::v1::GetLedgerHeadRequest(), &head);
      !status.ok())
    return status;
  const ledger::Head told = HeadOf(head);
  if (session->json) {
    std::cout << JsonLineOf(told) << "\n";  // as heads are sent out
    return absl::OkStatus();
  }
  std::cout << "plant      " << told.plant_id << "\nentries    " << told.tree_size << ", up to sequence "
            << told.record_sequence << "\nroot       " << ledger::HexOf(told.root) << "\nsigned     " << told.signed_at
            << " by key " << told.key_id << "\nsignature  " << ledger::HexOf(told.signature) << "\n"
            << head.public_key();
  return absl::OkStatus();
}

struct VerifyArguments {
  std::string heads_file, key_file;
  bool with_blobs = false;
};

// What a check found.
struct Found {
  std::vector<plant::v1::LedgerDamage> damages;
  std::map<std::string, std::int64_t> detached;
  std::vector<ledger::Finding> findings;
  std::int64_t size = 0, last_sequence = 0, heads_checked = 0, blobs = 0, unsealed = 0;
  ledger::Hash root;
  ledger::Head last_good;
  bool is_covered() const { return last_good.record_sequence >= last_sequence; }
  bool is_well() const { return damages.empty() && findings.empty(); }
};

std::string KindText(plant::v1::DamageKind kind) {
  return plant::v1::DamageKind_Name(kind).substr(std::string("DAMAGE_KIND_").size());
}
std::string KindText(ledger::FindingKind kind) {
  switch (kind) {
    case ledger::FindingKind::kRewritten:
      return "REWRITTEN";
    case ledger::FindingKind::kCutOff:
      return "CUT_OFF";
    case ledger::FindingKind::kNotSigned:
      return "NOT_SIGNED";
    case ledger::FindingKind::kAnotherPlant:
      return "ANOTHER_PLANT";
    case ledger::FindingKind::kNoHead:
      return "NO_HEAD";
  }
  return "";
}

absl::Status TakeSlice(const plant::v1::LedgerSlice& slice, ledger::Audit* audit, Found* found) {
  constexpr std::size_t kHashBytes = 32;
  if (slice.leaf_hashes().size() % kHashBytes != 0 ||
      (!slice.leaf_hashes().empty() && slice.first_leaf_index() != audit->size()))
    return absl::DataLossError("leaves from " + std::to_string(slice.first_leaf_index()) + " on, want those from " +
                               std::to_string(audit->size()));
  for (const plant::v1::LedgerHead& head : slice.heads()) audit->AddHead(HeadOf(head));
  std::vector<ledger::Hash> leaves;
  for (std::size_t at = 0; at < slice.leaf_hashes().size(); at += kHashBytes)
    leaves.push_back(slice.leaf_hashes().substr(at, kHashBytes));
  audit->AddLeaves(leaves);
  for (const plant::v1::LedgerDamage& damage : slice.damages())
    if (found->damages.size() < kMostDamages) found->damages.push_back(damage);
  for (const plant::v1::DetachedEntries& detached : slice.detached())
    found->detached[detached.month()] += detached.entry_count();
  found->last_sequence = slice.last_record_sequence();
  found->blobs = slice.checked_blob_count();
  found->unsealed = slice.unsealed_count();
  return absl::OkStatus();
}

absl::StatusOr<Found> Check(Session* session, const VerifyArguments& arguments, const std::vector<ledger::Head>& sent,
                            const std::string& key) {
  const Elapsed elapsed("comparing every row with what was sealed", session->json);
  Found found;
  const absl::Status checked = session->Retrying(
      "plant",
      [&](const std::shared_ptr<grpc::Channel>& channel, const std::unique_ptr<grpc::ClientContext>&) -> absl::Status {
        // Reads all of the record, which may take longer than a session waits for an answer.
        const std::unique_ptr<grpc::ClientContext> context = runtime::ContextWithoutDeadline();
        found = Found();
        ledger::Audit audit(sent, key);
        plant::v1::VerifyLedgerRequest request;
        request.set_with_blobs(arguments.with_blobs);
        const auto stub = LedgerService::NewStub(channel);
        const auto reader = stub->VerifyLedger(context.get(), request);
        plant::v1::LedgerSlice slice;
        bool is_whole = false;
        while (reader->Read(&slice)) {
          if (absl::Status taken = TakeSlice(slice, &audit, &found); !taken.ok()) return taken;
          is_whole = slice.is_last();
        }
        const absl::Status ended = runtime::FromGrpc(reader->Finish());
        if (!ended.ok()) return ended;
        if (!is_whole) return absl::DataLossError("the check ended before its last message");
        audit.Finish();
        found.findings = audit.findings();
        found.size = audit.size();
        found.root = audit.Root();
        found.heads_checked = audit.heads_checked();
        found.last_good = audit.last_good();
        return absl::OkStatus();
      });
  if (!checked.ok()) return checked;
  return found;
}

void PrintFoundJson(const Found& found) {
  ordered_json out;
  out["well"] = found.is_well();
  out["tree_size"] = found.size;
  out["root_sha256"] = ledger::HexOf(found.root);
  out["record_sequence"] = found.last_sequence;
  out["covered_record_sequence"] = found.last_good.record_sequence;
  out["heads_checked"] = found.heads_checked;
  out["unsealed_count"] = found.unsealed;
  out["checked_blob_count"] = found.blobs;
  out["damages"] = ordered_json::array();
  for (const plant::v1::LedgerDamage& damage : found.damages)
    out["damages"].push_back({{"kind", KindText(damage.kind())},
                              {"table", damage.table()},
                              {"name", damage.name()},
                              {"record_id", damage.record_id()},
                              {"record_sequence", damage.record_sequence()},
                              {"detail", damage.detail()}});
  out["heads"] = ordered_json::array();
  for (const ledger::Finding& finding : found.findings)
    out["heads"].push_back({{"kind", KindText(finding.kind)}, {"detail", finding.sentence}});
  out["detached"] = found.detached;
  std::cout << out.dump() << "\n";
}

void PrintText(const Found& found, const VerifyArguments& arguments) {
  for (const ledger::Finding& finding : found.findings)
    std::cout << KindText(finding.kind) << ": " << finding.sentence << "\n";
  Table table({"damage", "table", "entry", ">sequence", "detail"});
  int lines = 0;
  for (const plant::v1::LedgerDamage& damage : found.damages) {
    if (lines++ >= kMostDamageLines) break;
    table.AddRow({KindText(damage.kind()), damage.table(), damage.name().empty() ? damage.record_id() : damage.name(),
                  damage.record_sequence() == 0 ? "" : std::to_string(damage.record_sequence()), damage.detail()});
  }
  if (!table.empty()) std::cout << table.ToText();
  if (lines > kMostDamageLines) std::cout << "and " << found.damages.size() - kMostDamageLines << " more (--json)\n";
  for (const auto& [month, count] : found.detached)
    std::cout << "not here: the rows of " << count << " entries of " << month
              << ", a month that was detached; their leaves are in the tree\n";
  std::cout << found.size << " entries sealed, up to sequence " << found.last_sequence << "; " << found.unsealed
            << " not sealed yet; compared with " << found.heads_checked << " heads";
  if (arguments.with_blobs) std::cout << "; " << found.blobs << " blobs";
  std::cout << "\n";
  if (!found.is_covered())
    std::cout << "entries " << found.last_good.record_sequence + 1 << ".." << found.last_sequence
              << " stand under no head that agrees\n";
  if (arguments.heads_file.empty())
    std::cout << "no --heads: entries that were cut off, and a ledger that was made anew, cannot be told\n";
  if (arguments.key_file.empty()) std::cout << "no --key: signatures were not looked at\n";
  std::cout << (found.is_well() ? "as it was sealed\n" : "NOT as it was sealed\n");
}

absl::Status Verify(Session* session, const VerifyArguments& arguments) {
  std::vector<ledger::Head> sent;
  std::string key;
  if (!arguments.heads_file.empty()) {
    absl::StatusOr<std::vector<ledger::Head>> heads = ledger::ReadHeads(arguments.heads_file);
    if (!heads.ok()) return heads.status();
    if (heads->empty()) return runtime::Refuse("--heads", arguments.heads_file, "a file with heads that were sent out");
    sent = *std::move(heads);
  }
  if (!arguments.key_file.empty()) {
    absl::StatusOr<std::string> pem = ReadFile(arguments.key_file, 64 << 10);
    if (!pem.ok()) return pem.status();
    if (const auto id = ledger::KeyIdOf(*pem); !id.ok())
      return runtime::Refuse("--key", arguments.key_file, "the ledger's Ed25519 public key in PEM");
    key = *std::move(pem);
  }
  const absl::StatusOr<Found> found = Check(session, arguments, sent, key);
  if (!found.ok()) return found.status();
  if (session->json)
    PrintFoundJson(*found);
  else
    PrintText(*found, arguments);
  if (!found->is_well()) session->MarkNotUsable();
  return absl::OkStatus();
}

ordered_json EntryJson(const plant::v1::ProvenEntry& entry) {
  ordered_json out;
  out["leaf_index"] = entry.leaf_index();
  out["record_sequence"] = entry.record_sequence();
  out["name"] = entry.name();
  out["leaf"] = entry.leaf();
  out["name_row"] = entry.name_row();
  out["content"] = entry.content();
  out["tables"] = ordered_json::object();
  for (const plant::v1::SealedRows& rows : entry.tables())
    out["tables"][rows.table()] = std::vector<std::string>(rows.rows().begin(), rows.rows().end());
  out["audit_path"] = ordered_json::array();
  for (const std::string& hash : entry.audit_path()) out["audit_path"].push_back(ledger::HexOf(hash));
  return out;
}

// What goes to a stranger is looked at here first.
absl::Status CheckEntry(const plant::v1::ProvenEntry& entry, const ledger::Head& head) {
  if (ledger::PathProves(ledger::LeafHash(entry.leaf()), entry.leaf_index(), head.tree_size,
                         {entry.audit_path().begin(), entry.audit_path().end()}, head.root))
    return absl::OkStatus();
  return absl::DataLossError(entry.name() +
                             ": its path does not lead to the signed root: see `sixpoint ledger verify`");
}

absl::Status Prove(Session* session, const std::string& serial, const std::string& out) {
  if (absl::Status writable = CheckOut(*session, out); !writable.ok()) return writable;
  plant::v1::GetBladeProofRequest request;
  request.set_name(NameText("blades", serial));
  ordered_json proof;
  ledger::Head head;
  const auto take = [&](const plant::v1::ProvenEntry& entry) -> absl::Status {
    if (entry.has_head()) {
      head = HeadOf(entry.head());
      proof["format"] = "sixpoint-ledger-proof-1";
      proof["blade"] = request.name();
      proof["head"] = ordered_json::parse(JsonLineOf(head));
      proof["public_key"] = entry.head().public_key();
      proof["unsealed_count"] = entry.unsealed_count();
      proof["entries"] = ordered_json::array();
    }
    if (absl::Status proven = CheckEntry(entry, head); !proven.ok()) return proven;
    proof["entries"].push_back(EntryJson(entry));
    return absl::OkStatus();
  };
  const auto begin = [&] {
    proof = ordered_json();
    head = ledger::Head();
  };
  const absl::Status told = FetchEach<LedgerService>(session, "proving " + request.name(), "plant",
                                                     &LedgerService::Stub::GetBladeProof, request, begin, take);
  if (!told.ok()) return told;
  if (absl::Status written = WriteOut(out, proof.dump(1) + "\n"); !written.ok()) return written;
  if (session->json)
    BesideOut(out) << ordered_json{{"out", out},
                                   {"entries", proof["entries"].size()},
                                   {"unsealed_count", proof["unsealed_count"]}}
                          .dump()
                   << "\n";
  else
    BesideOut(out) << proof["entries"].size() << " entries of " << request.name() << " proven in " << OutText(out)
                   << "; check it with docs/examples/check_ledger_proof.py\n";
  return absl::OkStatus();
}

}  // namespace

void AddLedgerCommands(Command* app, Session* session) {
  Command* ledger = app->AddCommand("ledger", "What was recorded, proven to be as it was");
  ledger->RequireCommand();
  Command* head = ledger->AddCommand("head", "The newest signed head; --json: as it is sent out, a line for --heads");
  session->OnCommand(head, [session] { return ShowHead(session); });

  const auto verify_arguments = std::make_shared<VerifyArguments>();
  Command* verify = ledger->AddCommand("verify", "Compares every row with what was sealed; 4: not as it was");
  verify->AddOption("--heads", &verify_arguments->heads_file, "Heads that were sent out, a file with one a line");
  verify->AddOption("--key", &verify_arguments->key_file,
                    "The ledger's public key, a PEM file from elsewhere than the plant");
  verify->AddFlag("--blobs", &verify_arguments->with_blobs,
                  "The bytes of clouds, meshes and programs in PostgreSQL, too");
  session->OnCommand(verify, [session, verify_arguments] { return Verify(session, *verify_arguments); });

  const auto serial = std::make_shared<std::string>(), out = std::make_shared<std::string>();
  Command* proof = ledger->AddCommand("proof", "All that is recorded of a blade, with what proves it to a stranger");
  proof->AddOption("SERIAL", serial.get(), "The blade's serial number")->Required();
  AddOutOption(proof, out.get(), "The proof, JSON")->Required();
  session->OnCommand(proof, [session, serial, out] { return Prove(session, *serial, *out); });
}

}  // namespace sixpoint::cli
