#include <CLI/CLI.hpp>
#include <iostream>

#include "cli/cloud_files.h"
#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/scan_transfer.h"
#include "cli/table.h"
#include "services/runtime/errors.h"
#include "services/runtime/resource_name.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using ingest::v1::ScanService;

struct UploadArguments {
  std::string file, machine, subject, kind, scan_id;
  std::vector<double> v0_mm;
  double a_deg = 0, b_deg = 0, pitch_mm = 0;
  int columns = 0;
};

// "blade:SN-1" -> "blades/SN-1", "artefact:P" -> "artefacts/P"; a resource name is taken as it is.
absl::StatusOr<std::string> SubjectName(const std::string& text) {
  if (text.rfind("blade:", 0) == 0) return runtime::NameOf("blades", text.substr(6));
  if (text.rfind("artefact:", 0) == 0) return runtime::NameOf("artefacts", text.substr(9));
  if (text.rfind("blades/", 0) == 0 || text.rfind("artefacts/", 0) == 0) return text;
  return runtime::Refuse("--subject", text, "blade:SERIAL or artefact:ID");
}

absl::StatusOr<ingest::v1::ScanKind> KindOf(const std::string& text) {
  for (int i = 1; i < ingest::v1::ScanKind_ARRAYSIZE; ++i) {
    const auto kind = static_cast<ingest::v1::ScanKind>(i);
    if (EnumText(ScanKind_Name(kind), "SCAN_KIND_") == text) return kind;
  }
  return runtime::Refuse("--kind", text, "artefact, arm, airfoil, local or pins");
}

void PrintScan(const Session& session, const ingest::v1::Scan& scan) {
  if (session.json) return PrintJson(MessageToJson(scan));
  const ingest::v1::ScanHeader& header = scan.header();
  std::cout << scan.name() << ", " << EnumText(ScanKind_Name(header.kind()), "SCAN_KIND_") << " of " << header.subject()
            << " on " << header.machine() << "\n"
            << "pose      V0 " << PointText(header.v0_mm(), 4) << " mm, A " << Fixed(header.a_deg(), 4) << " deg, B "
            << Fixed(header.b_deg(), 4) << " deg, pitch " << Fixed(header.profile_pitch_mm(), 4) << " mm\n"
            << "points    " << Grouped(header.point_count()) << " in " << scan.block_count() << " blocks, "
            << Grouped(scan.stored_bytes()) << " bytes, proven error " << Fixed(scan.proven_error_um(), 3) << " um\n"
            << "sha256    " << scan.sha256() << "\n"
            << "received  " << TimeText(scan.received_at()) << ", sequence " << scan.record_sequence() << "\n";
}

absl::Status Upload(Session* session, const UploadArguments& arguments) {
  ingest::v1::ScanHeader header;
  absl::StatusOr<std::string> subject = SubjectName(arguments.subject);
  if (!subject.ok()) return subject.status();
  absl::StatusOr<ingest::v1::ScanKind> kind = KindOf(arguments.kind);
  if (!kind.ok()) return kind.status();
  if (arguments.v0_mm.size() != 3) {
    return runtime::Refuse("--v0-mm", std::to_string(arguments.v0_mm.size()) + " numbers", "X,Y,Z");
  }
  header.set_scan_id(arguments.scan_id.empty() ? NewRequestId() : arguments.scan_id);
  header.set_machine(runtime::NameOf("machines", arguments.machine));
  header.set_subject(*subject);
  header.set_kind(*kind);
  header.mutable_v0_mm()->set_x_mm(arguments.v0_mm[0]);
  header.mutable_v0_mm()->set_y_mm(arguments.v0_mm[1]);
  header.mutable_v0_mm()->set_z_mm(arguments.v0_mm[2]);
  header.set_a_deg(arguments.a_deg);
  header.set_b_deg(arguments.b_deg);
  header.set_profile_pitch_mm(arguments.pitch_mm);
  header.set_columns_per_profile(arguments.columns);
  if (arguments.columns == 0) {
    plant::v1::GetMachineRequest request;
    request.set_name(header.machine());
    plant::v1::Machine machine;
    absl::Status status =
        session->Call<plant::v1::PlantService>("plant", &plant::v1::PlantService::Stub::GetMachine, request, &machine);
    if (!status.ok()) return status;
    header.set_columns_per_profile(machine.sensor().column_count());
  }
  absl::StatusOr<metrology::Points> points = ReadCloud(arguments.file);
  if (!points.ok()) return points.status();
  absl::StatusOr<EncodedScan> encoded = EncodeScan(*points);
  if (!encoded.ok()) return encoded.status();
  absl::StatusOr<ingest::v1::UploadScanResponse> response;
  {
    Progress progress("upload", "points", encoded->point_count, session->json);
    response = UploadScan(session, header, *encoded, [&](std::int64_t count) { progress.Add(count); });
  }
  if (!response.ok()) return response.status();
  if (session->json) {
    PrintJson(MessageToJson(*response));
    return absl::OkStatus();
  }
  PrintScan(*session, response->scan());
  if (response->already_stored()) std::cout << "it was stored before, with the same content\n";
  return absl::OkStatus();
}

void AddUpload(CLI::App* scan, Session* session) {
  const auto arguments = std::make_shared<UploadArguments>();
  CLI::App* upload = scan->add_subcommand("upload", "Uploads one scan; it is durable when the command is done");
  upload->add_option("FILE", arguments->file, "Sensor frame, mm: .drc, .ply, .pcd, .xyz")->required();
  upload->add_option("--machine", arguments->machine, "The machine that scanned")->required();
  upload->add_option("--subject", arguments->subject, "blade:SERIAL or artefact:ID")->required();
  upload->add_option("--kind", arguments->kind, "artefact, arm, airfoil, local or pins")->required();
  upload->add_option("--v0-mm", arguments->v0_mm, "Machine position at the start of the scan: X,Y,Z")
      ->required()
      ->delimiter(',')
      ->allow_extra_args(false);
  upload->add_option("--a-deg", arguments->a_deg, "A axis as commanded")->required();
  upload->add_option("--b-deg", arguments->b_deg, "B axis as commanded")->required();
  upload->add_option("--pitch-mm", arguments->pitch_mm, "Encoder distance between profiles")->required();
  upload->add_option("--columns", arguments->columns,
                     "Sensor columns in a profile; without it, the machine's sensor says");
  upload->add_option("--scan-id", arguments->scan_id,
                     "Id of the scan; the same again is the same scan. Without it: a new one");
  session->OnCommand(upload, [session, arguments] { return Upload(session, *arguments); });
}

void AddList(CLI::App* scan, Session* session) {
  const auto arguments = std::make_shared<UploadArguments>();
  CLI::App* list = scan->add_subcommand("list", "Lists scans, newest first");
  list->add_option("--machine", arguments->machine, "Only of this machine");
  list->add_option("--subject", arguments->subject, "Only of blade:SERIAL or artefact:ID");
  list->add_option("--kind", arguments->kind, "Only artefact, arm, airfoil, local or pins");
  session->OnCommand(list, [session, arguments]() -> absl::Status {
    ingest::v1::ListScansRequest request;
    if (!arguments->machine.empty()) request.set_machine(runtime::NameOf("machines", arguments->machine));
    if (!arguments->subject.empty()) {
      absl::StatusOr<std::string> subject = SubjectName(arguments->subject);
      if (!subject.ok()) return subject.status();
      request.set_subject(*subject);
    }
    if (!arguments->kind.empty()) {
      absl::StatusOr<ingest::v1::ScanKind> kind = KindOf(arguments->kind);
      if (!kind.ok()) return kind.status();
      request.set_kind(*kind);
    }
    nlohmann::json json = nlohmann::json::array();
    Table table({"scan", "kind", "subject", "machine", ">A deg", ">B deg", ">points", ">bytes", "received"});
    absl::Status status = ForEachPage<ScanService>(
        session, "ingest", &ScanService::Stub::ListScans, request, [&](const ingest::v1::ListScansResponse& page) {
          for (const ingest::v1::Scan& entry : page.scans()) {
            json.push_back(MessageToJson(entry));
            const ingest::v1::ScanHeader& header = entry.header();
            table.AddRow({IdText(entry.name()), EnumText(ScanKind_Name(header.kind()), "SCAN_KIND_"), header.subject(),
                          IdText(header.machine()), Fixed(header.a_deg(), 3), Fixed(header.b_deg(), 3),
                          Grouped(header.point_count()), Grouped(entry.stored_bytes()), TimeText(entry.received_at())});
          }
        });
    if (!status.ok()) return status;
    PrintList(session->json, json, table);
    return status;
  });
}

}  // namespace

void AddScanCommands(CLI::App* app, Session* session) {
  CLI::App* scan = app->add_subcommand("scan", "Scans: upload, look, download, delete points");
  scan->require_subcommand(1);
  AddUpload(scan, session);
  AddList(scan, session);
  AddDeletePointsCommand(scan, session);
  const auto id = std::make_shared<std::string>();
  const auto file = std::make_shared<std::string>();

  CLI::App* show = scan->add_subcommand("show", "Shows a scan's record");
  show->add_option("ID", *id, "The scan")->required();
  session->OnCommand(show, [session, id]() -> absl::Status {
    ingest::v1::GetScanRequest request;
    request.set_name(runtime::NameOf("scans", *id));
    ingest::v1::Scan response;
    absl::Status status = session->Call<ScanService>("ingest", &ScanService::Stub::GetScan, request, &response);
    if (status.ok()) PrintScan(*session, response);
    return status;
  });

  CLI::App* download = scan->add_subcommand("download", "Writes a scan's points, sensor frame, mm");
  download->add_option("ID", *id, "The scan")->required();
  download->add_option("-o,--out", *file, ".ply or .xyz")->required();
  session->OnCommand(download, [session, id, file]() -> absl::Status {
    absl::StatusOr<DownloadedScan> downloaded = DownloadScan(session, runtime::NameOf("scans", *id));
    if (!downloaded.ok()) return downloaded.status();
    absl::Status status = WriteCloud(*file, downloaded->points_mm);
    if (!status.ok()) return status;
    if (session->json) {
      PrintJson({{"file", *file}, {"point_count", downloaded->points_mm.size()}});
    } else {
      std::cout << Grouped(static_cast<std::int64_t>(downloaded->points_mm.size())) << " points written to " << *file
                << "\n";
    }
    return status;
  });
}

}  // namespace sixpoint::cli
