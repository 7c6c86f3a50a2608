// The keeping of stored clouds: check, collect, status, retention; `scan delete-points`.
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/commands.h"
#include "cli/message_json.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/scan_kind.h"
#include "cli/table.h"
#include "services/runtime/errors.h"
#include "sixpoint/ingest/v1/store.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using ingest::v1::CloudStoreService;
using StoreStub = CloudStoreService::Stub;

std::string HolderName(ingest::v1::BlobHolder holder) {
  return EnumText(ingest::v1::BlobHolder_Name(holder), "BLOB_HOLDER_");
}

std::string KeptText(int keep_days) {
  return keep_days == 0 ? "for ever" : Grouped(keep_days) + (keep_days == 1 ? " day" : " days");
}

Table DamageTable() { return Table({"sha256", "holder", "damage", "detail", "found"}); }

void AddDamage(const ingest::v1::BlobDamage& damage, Table* table) {
  table->AddRow({damage.sha256(), HolderName(damage.holder()),
                 EnumText(ingest::v1::DamageKind_Name(damage.kind()), "DAMAGE_KIND_"), damage.detail(),
                 TimeText(damage.found_at())});
}

absl::StatusOr<ingest::v1::StoreStatus> GetStatus(Session* session) {
  ingest::v1::StoreStatus response;
  absl::Status status = session->Call<CloudStoreService>("ingest", &StoreStub::GetStoreStatus,
                                                         ingest::v1::GetStoreStatusRequest(), &response);
  if (!status.ok()) return status;
  return response;
}

// What a whole check found, over as many calls as it took.
struct Checked {
  std::string after_sha256;
  std::int64_t count = 0;
  std::int64_t bytes = 0;
  std::vector<ingest::v1::BlobDamage> damages;
  bool complete = false;
};

// One call, which ends with its deadline at the latest. Each message counts from the call's beginning.
absl::Status CheckOnce(Session* session, double rate_mb_s, Progress* progress, Checked* checked) {
  return session->Retrying(
      "ingest", [&](const std::shared_ptr<grpc::Channel>& channel, std::unique_ptr<grpc::ClientContext> context) {
        ingest::v1::CheckStoreRequest request;
        request.set_after_sha256(checked->after_sha256);
        request.set_rate_mb_s(rate_mb_s);
        const auto stub = CloudStoreService::NewStub(channel);
        const auto reader = stub->CheckStore(context.get(), request);
        const std::int64_t count_before = checked->count, bytes_before = checked->bytes;
        ingest::v1::CheckStoreResponse response;
        while (reader->Read(&response)) {
          progress->Add(bytes_before + response.checked_bytes() - checked->bytes);
          checked->count = count_before + response.checked_count();
          checked->bytes = bytes_before + response.checked_bytes();
          if (!response.after_sha256().empty()) checked->after_sha256 = response.after_sha256();
          checked->damages.insert(checked->damages.end(), response.damages().begin(), response.damages().end());
          checked->complete = response.complete();
        }
        return runtime::FromGrpc(reader->Finish());
      });
}

absl::Status Check(Session* session, double rate_mb_s, const std::string& after_sha256) {
  const absl::StatusOr<ingest::v1::StoreStatus> before = GetStatus(session);
  if (!before.ok()) return before.status();
  std::int64_t total_bytes = 0;
  for (const ingest::v1::HolderUse& use : before->uses()) total_bytes += use.kept_bytes();
  Checked checked;
  checked.after_sha256 = after_sha256;
  {
    Progress progress("check", "bytes", total_bytes, session->json);
    while (!checked.complete) {
      const std::int64_t count_before = checked.count;
      const absl::Status status = CheckOnce(session, rate_mb_s, &progress, &checked);
      // A store that takes longer than one call's deadline takes several calls.
      const bool went_on = checked.count > count_before;
      if (!status.ok() && !(absl::IsDeadlineExceeded(status) && went_on)) return status;
    }
  }
  if (!checked.damages.empty()) session->MarkNotUsable();
  if (session->json) {
    nlohmann::json json = {{"checked_count", checked.count},
                           {"checked_bytes", checked.bytes},
                           {"damaged_count", checked.damages.size()},
                           {"damages", nlohmann::json::array()}};
    for (const ingest::v1::BlobDamage& damage : checked.damages) json["damages"].push_back(MessageToJson(damage));
    PrintJson(json);
    return absl::OkStatus();
  }
  Table table = DamageTable();
  for (const ingest::v1::BlobDamage& damage : checked.damages) AddDamage(damage, &table);
  if (!table.empty()) std::cout << table.ToText();
  std::cout << Grouped(checked.count) << " blobs, " << Grouped(checked.bytes) << " bytes checked, "
            << Grouped(static_cast<std::int64_t>(checked.damages.size())) << " damaged\n";
  return absl::OkStatus();
}

absl::Status PrintStatus(Session* session) {
  const absl::StatusOr<ingest::v1::StoreStatus> status = GetStatus(session);
  if (!status.ok()) return status.status();
  if (session->json) {
    PrintJson(*status);
    return absl::OkStatus();
  }
  Table table({"holder", ">kept", ">bytes", ">deleted", ">bytes deleted"});
  for (const ingest::v1::HolderUse& use : status->uses()) {
    table.AddRow({HolderName(use.holder()), Grouped(use.kept_count()), Grouped(use.kept_bytes()),
                  Grouped(use.deleted_count()), Grouped(use.deleted_bytes())});
  }
  std::cout << "new clouds go to " << HolderName(status->new_blobs()) << "\n" << table.ToText();
  std::cout << "check     " << Grouped(status->checked_count()) << " blobs since " << TimeText(status->check_begun_at())
            << ", last whole pass ended " << TimeText(status->check_finished_at()) << "\n";
  Table damages = DamageTable();
  for (const ingest::v1::BlobDamage& damage : status->damages()) AddDamage(damage, &damages);
  std::cout << (damages.empty() ? "no damage was ever found\n" : damages.ToText());
  return absl::OkStatus();
}

absl::Status Collect(Session* session, bool dry_run, std::int64_t grace_s) {
  ingest::v1::CollectGarbageRequest request;
  request.set_dry_run(dry_run);
  request.set_grace_s(grace_s);
  ingest::v1::CollectGarbageResponse response;
  absl::Status status = session->Call<CloudStoreService>("ingest", &StoreStub::CollectGarbage, request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(response);
    return status;
  }
  std::cout << (dry_run ? "would be collected: " : "collected: ") << Grouped(response.blob_count()) << " blobs ("
            << Grouped(response.blob_bytes()) << " bytes), " << Grouped(response.object_count())
            << " objects without a blob (" << Grouped(response.object_bytes()) << " bytes)\n";
  return status;
}

absl::Status SetPolicy(Session* session, const std::string& kind_text, int keep_days) {
  const absl::StatusOr<ingest::v1::ScanKind> kind = ScanKindOf("KIND", kind_text);
  if (!kind.ok()) return kind.status();
  ingest::v1::SetRetentionPolicyRequest request;
  request.set_scan_kind(*kind);
  request.set_keep_days(keep_days);
  request.set_request_id(NewRequestId());
  ingest::v1::RetentionPolicy response;
  absl::Status status = session->Call<CloudStoreService>("ingest", &StoreStub::SetRetentionPolicy, request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(response);
  } else {
    std::cout << "points of " << ScanKindText(response.scan_kind()) << " scans are kept "
              << KeptText(response.keep_days()) << " (revision " << response.revision() << ")\n";
  }
  return status;
}

absl::Status ApplyPolicies(Session* session, bool dry_run) {
  ingest::v1::ApplyRetentionRequest request;
  request.set_dry_run(dry_run);
  ingest::v1::ApplyRetentionResponse response;
  absl::Status status = session->Call<CloudStoreService>("ingest", &StoreStub::ApplyRetention, request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(response);
    return status;
  }
  std::cout << (dry_run ? "points of " : "deleted the points of ") << Grouped(response.scan_count()) << " scans ("
            << Grouped(response.scan_bytes()) << " bytes)";
  if (dry_run) {
    std::cout << " are older than their policy\n";
  } else {
    std::cout << "; " << Grouped(response.freed_bytes()) << " bytes went\n";
  }
  return status;
}

absl::Status DeletePoints(Session* session, const std::string& scan_id, const std::string& reason) {
  ingest::v1::DeleteScanPointsRequest request;
  request.set_name(NameText("scans", scan_id));
  request.set_reason(reason);
  ingest::v1::DeleteScanPointsResponse response;
  absl::Status status = session->Call<CloudStoreService>("ingest", &StoreStub::DeleteScanPoints, request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(response);
    return status;
  }
  const ingest::v1::ScanDeletion& deletion = response.deletion();
  std::cout << "points of " << deletion.scan() << (response.already_deleted() ? " were deleted before, " : " deleted ")
            << TimeText(deletion.deleted_at()) << ", sequence " << deletion.record_sequence() << "\n"
            << "reason    " << deletion.reason() << "\n"
            << "sha256    " << deletion.points_sha256() << " of " << Grouped(deletion.points_bytes()) << " bytes\n"
            << "freed     " << Grouped(response.freed_bytes()) << " bytes\n";
  return status;
}

absl::Status AdoptBucket(Session* session) {
  ingest::v1::AdoptBucketRequest request;
  ingest::v1::AdoptBucketResponse response;
  absl::Status status = session->Call<CloudStoreService>("ingest", &StoreStub::AdoptBucket, request, &response);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(response);
  } else {
    std::cout << "the bucket is this plant's; before: "
              << (response.owner_before().empty() ? "nobody's" : response.owner_before()) << "\n";
  }
  return status;
}

void AddRetention(Command* store, Session* session) {
  Command* retention = store->AddCommand("retention", "How long points of scans are kept, by kind of scan");
  retention->RequireCommand();
  const auto kind = std::make_shared<std::string>();
  const auto keep_days = std::make_shared<int>(0);
  const auto flag = std::make_shared<bool>(false);

  Command* set = retention->AddCommand("set", "Sets the policy of a kind; scans, values and results stay for ever");
  set->AddOption("KIND", kind.get(), kScanKinds)->Required();
  Command* how_long = set->AddChoice("how long");
  how_long->AddOption("--keep-days", keep_days.get(), "Whole days since the scan was recorded")->Within(1, 36'525);
  how_long->AddFlag("--for-ever", flag.get(), "Nothing of this kind is deleted by age");
  session->OnCommand(set, [session, kind, keep_days] { return SetPolicy(session, *kind, *keep_days); });

  AddListCommand<CloudStoreService>(
      retention, session, "Lists the policies; a kind without one is kept for ever", "ingest",
      &StoreStub::ListRetentionPolicies, ingest::v1::ListRetentionPoliciesRequest(),
      Table({"kind", ">revision", "points kept", "by", "since"}), &ingest::v1::ListRetentionPoliciesResponse::policies,
      [](const ingest::v1::RetentionPolicy& policy) {
        return Cells{ScanKindText(policy.scan_kind()), std::to_string(policy.revision()), KeptText(policy.keep_days()),
                     policy.requested_by(), TimeText(policy.recorded_at())};
      });

  Command* apply = retention->AddCommand("apply", "Applies the policies now; ingest does it every hour by itself");
  apply->AddFlag("--dry-run", flag.get(), "Only counts");
  session->OnCommand(apply, [session, flag] { return ApplyPolicies(session, *flag); });
}

absl::Status Partitions(Session* session, std::optional<int> months_ahead) {
  ingest::v1::MakeMonthsResponse made;
  if (months_ahead) {
    ingest::v1::MakeMonthsRequest make;
    make.set_months_ahead(*months_ahead);
    absl::Status status = session->Call<CloudStoreService>("ingest", &StoreStub::MakeMonths, make, &made);
    if (!status.ok()) return status;
  }
  ingest::v1::ListMonthsResponse months;
  absl::Status status =
      session->Call<CloudStoreService>("ingest", &StoreStub::ListMonths, ingest::v1::ListMonthsRequest(), &months);
  if (!status.ok()) return status;
  if (session->json) {
    PrintJson(months);
    return status;
  }
  Table table({"month", ">partitions", ">rows", ">bytes"});
  for (const ingest::v1::Month& month : months.months())
    table.AddRow(
        {month.month(), std::to_string(month.partition_count()), Grouped(month.row_count()), Grouped(month.bytes())});
  std::cout << table.ToText();
  if (months_ahead) std::cout << made.made_count() << " partitions made\n";
  return status;
}

}  // namespace

void AddDeletePointsCommand(Command* scan, Session* session) {
  const auto id = std::make_shared<std::string>();
  const auto reason = std::make_shared<std::string>();
  Command* remove = scan->AddCommand("delete-points", "Deletes a scan's points for good; its values and results stay");
  remove->AddOption("ID", id.get(), "The scan")->Required();
  remove->AddOption("--reason", reason.get(), "Why; it stays in the record")->Required();
  session->OnCommand(remove, [session, id, reason] { return DeletePoints(session, *id, *reason); });
}

void AddStorageCommands(Command* app, Session* session) {
  Command* storage = app->AddCommand("storage", "The database's own keeping");
  storage->RequireCommand();
  const auto months_ahead = std::make_shared<std::optional<int>>();
  Command* partitions = storage->AddCommand("partitions", "The months that the journal, scans and results are kept by");
  partitions->AddOption("--months-ahead", months_ahead.get(), "Makes so many beside this one; the plant keeps three")
      ->Within(0, 120);
  session->OnCommand(partitions, [session, months_ahead] { return Partitions(session, *months_ahead); });
}

void AddStoreCommands(Command* app, Session* session) {
  Command* store = app->AddCommand("store", "The keeping of stored clouds");
  store->RequireCommand();
  const auto rate_mb_s = std::make_shared<double>(0);
  const auto after_sha256 = std::make_shared<std::string>();
  const auto dry_run = std::make_shared<bool>(false);
  const auto grace_s = std::make_shared<std::int64_t>(0);

  Command* check = store->AddCommand("check", "Reads every stored blob and holds it against its size and SHA-256");
  check->AddOption("--rate-mb-s", rate_mb_s.get(), "At most so fast; without it as fast as it goes")->Within(0.0, 1e6);
  check->AddOption("--after", after_sha256.get(), "Goes on after this SHA-256");
  session->OnCommand(check, [session, rate_mb_s, after_sha256] { return Check(session, *rate_mb_s, *after_sha256); });

  Command* collect = store->AddCommand("collect", "Takes away blobs that nothing refers to");
  collect->AddFlag("--dry-run", dry_run.get(), "Only counts");
  collect->AddOption("--grace-s", grace_s.get(), "Leaves younger ones; without it one day")->Within(1, 31'622'400);
  session->OnCommand(collect, [session, dry_run, grace_s] { return Collect(session, *dry_run, *grace_s); });

  Command* adopt = store->AddCommand(
      "adopt-bucket", "Makes the bucket this plant's, after a restore or a move; what it lacks a row of may go then");
  session->OnCommand(adopt, [session] { return AdoptBucket(session); });

  Command* status = store->AddCommand("status", "What is stored where, and what the checks found");
  session->OnCommand(status, [session] { return PrintStatus(session); });
  AddRetention(store, session);
}

}  // namespace sixpoint::cli
