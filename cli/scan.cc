#include <algorithm>
#include <charconv>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/cloud_files.h"
#include "cli/commands.h"
#include "cli/number_format.h"
#include "cli/out_file.h"
#include "cli/output.h"
#include "cli/rotary_letters.h"
#include "cli/scan_kind.h"
#include "cli/scan_transfer.h"
#include "cli/table.h"
#include "services/runtime/errors.h"
#include "sixpoint/ingest/v1/ingest.grpc.pb.h"
#include "sixpoint/plant/v1/plant.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using ingest::v1::ScanService;

struct UploadArguments {
  std::string file, machine, subject, kind, scan_id, arm_series, clamping, station, sensor_serial_number, travel;
  std::optional<double> temperature_c, scales_temperature_c;
  std::vector<double> v0_mm;
  LetteredCommands commands;
  double pitch_mm = 0, error_bound_um = 0;
  int columns = 0;
  std::string cloud, unit;
};

// What is stated of how it was taken; empty: nothing.
std::string ConditionsText(const ingest::v1::ScanHeader& header) {
  std::string text;
  const auto add = [&](const std::string& more) { text += (text.empty() ? "" : ", ") + more; };
  if (!header.station().empty()) add("at station " + header.station());
  if (!header.clamping().empty()) add("in clamping " + header.clamping());
  if (!header.arm_series().empty()) add("the arm in series " + header.arm_series());
  if (header.has_subject_temperature_c()) add("at " + Fixed(header.subject_temperature_c(), 2) + " C");
  if (header.has_scales_temperature_c()) add("the scales at " + Fixed(header.scales_temperature_c(), 2) + " C");
  if (!header.sensor_serial_number().empty()) add("by sensor " + header.sensor_serial_number());
  if (header.travel() != ingest::v1::SCAN_TRAVEL_UNSPECIFIED)
    add(header.travel() == ingest::v1::SCAN_TRAVEL_FORWARD ? "forward" : "backward");
  return text;
}

// Profiles by their pitch, or what a snapshot came in.
std::string CloudText(const ingest::v1::ScanHeader& header) {
  if (header.cloud() != ingest::v1::CLOUD_KIND_SNAPSHOT) return "pitch " + Fixed(header.profile_pitch_mm(), 4) + " mm";
  switch (header.length_unit()) {
    case ingest::v1::LENGTH_UNIT_METRE:
      return "a snapshot, sent in m";
    case ingest::v1::LENGTH_UNIT_INCH:
      return "a snapshot, sent in inches";
    default:
      return "a snapshot, sent in mm";
  }
}

// What the file's points are. A cloud's file says neither that nor its unit.
absl::Status SetCloud(const UploadArguments& arguments, const plant::v1::Machine& machine,
                      ingest::v1::ScanHeader* header) {
  if (arguments.cloud != "snapshot") {
    if (!arguments.unit.empty() && arguments.unit != "mm")
      return runtime::Refuse("--unit", arguments.unit, "mm of profiles; another with --cloud snapshot");
    if (!(arguments.pitch_mm > 0))
      return runtime::Refuse("--pitch-mm", "not given",
                             "the encoder distance between profiles; or --cloud snapshot, which has none");
    header->set_profile_pitch_mm(arguments.pitch_mm);
    header->set_columns_per_profile(arguments.columns == 0 ? machine.sensor().column_count() : arguments.columns);
    return absl::OkStatus();
  }
  if (arguments.unit.empty())
    return runtime::Refuse("--unit", "not given", "mm, m or inch: the file of a snapshot does not say what it is in");
  header->set_cloud(ingest::v1::CLOUD_KIND_SNAPSHOT);
  header->set_length_unit(arguments.unit == "m"      ? ingest::v1::LENGTH_UNIT_METRE
                          : arguments.unit == "inch" ? ingest::v1::LENGTH_UNIT_INCH
                                                     : ingest::v1::LENGTH_UNIT_MILLIMETRE);
  header->set_profile_pitch_mm(arguments.pitch_mm);  // refused by the service, as the columns are: a snapshot has none
  header->set_columns_per_profile(arguments.columns);
  return absl::OkStatus();
}

// letters: the machine's, of the axis on the bed and of the one that it carries.
void PrintScan(const Session& session, const ingest::v1::Scan& scan, const std::vector<std::string>& letters) {
  if (session.json) return PrintJson(scan);
  const ingest::v1::ScanHeader& header = scan.header();
  const double commands_deg[] = {header.a_deg(), header.b_deg()};
  std::string commands;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, letters.size()); ++i)
    commands += letters[i] + " " + Fixed(commands_deg[i], 4) + " deg, ";
  std::cout << scan.name() << ", " << ScanKindText(header.kind()) << " of " << header.subject() << " on "
            << header.machine() << "\n"
            << "pose      V0 " << PointText(header.v0_mm(), 4) << " mm, " << commands << CloudText(header) << "\n"
            << "points    " << Grouped(header.point_count()) << " in " << scan.block_count() << " blocks, "
            << Grouped(scan.stored_bytes()) << " bytes, proven error " << Fixed(scan.proven_error_um(), 3) << " um\n"
            << "sha256    " << scan.sha256() << "\n";
  if (const std::string conditions = ConditionsText(header); !conditions.empty())
    std::cout << "taken     " << conditions << "\n";
  std::cout << "received  " << TimeText(scan.received_at()) << ", sequence " << scan.record_sequence() << "\n";
}

absl::Status Upload(Session* session, const UploadArguments& arguments) {
  ingest::v1::ScanHeader header;
  absl::StatusOr<std::string> subject = SubjectNameText("--subject", arguments.subject);
  if (!subject.ok()) return subject.status();
  absl::StatusOr<ingest::v1::ScanKind> kind = ScanKindOf("--kind", arguments.kind);
  if (!kind.ok()) return kind.status();
  const auto v0_mm = ThreeOf("--v0-mm", arguments.v0_mm, "X,Y,Z");
  if (!v0_mm.ok()) return v0_mm.status();
  header.set_scan_id(arguments.scan_id.empty() ? NewRequestId() : arguments.scan_id);
  header.set_machine(NameText("machines", arguments.machine));
  header.set_subject(*subject);
  header.set_kind(*kind);
  header.mutable_v0_mm()->set_x_mm((*v0_mm)[0]);
  header.mutable_v0_mm()->set_y_mm((*v0_mm)[1]);
  header.mutable_v0_mm()->set_z_mm((*v0_mm)[2]);
  const absl::StatusOr<plant::v1::Machine> machine = FetchMachine(session, header.machine());
  if (!machine.ok()) return machine.status();
  const absl::StatusOr<std::vector<double>> commands_deg = CommandsOf(arguments.commands, *machine);
  if (!commands_deg.ok()) return commands_deg.status();
  if (!commands_deg->empty()) header.set_a_deg(commands_deg->at(0));
  if (commands_deg->size() > 1) header.set_b_deg(commands_deg->at(1));
  if (absl::Status cloud = SetCloud(arguments, *machine, &header); !cloud.ok()) return cloud;
  header.set_arm_series(arguments.arm_series);
  header.set_clamping(arguments.clamping);
  header.set_station(arguments.station);
  header.set_sensor_serial_number(arguments.sensor_serial_number);
  if (!arguments.travel.empty())
    header.set_travel(arguments.travel == "forward" ? ingest::v1::SCAN_TRAVEL_FORWARD
                                                    : ingest::v1::SCAN_TRAVEL_BACKWARD);
  if (arguments.temperature_c) header.set_subject_temperature_c(*arguments.temperature_c);
  if (arguments.scales_temperature_c) header.set_scales_temperature_c(*arguments.scales_temperature_c);
  header.set_encoding(ingest::v1::ENCODING_XYZ_F64);
  header.set_error_bound_um(arguments.error_bound_um);
  absl::StatusOr<metrology::Points> points = ReadCloud(arguments.file);
  if (!points.ok()) return points.status();
  const absl::StatusOr<clients::OutgoingScan> outgoing = clients::PrepareScan(std::move(header), *points);
  if (!outgoing.ok()) return outgoing.status();
  absl::StatusOr<ingest::v1::StoredScan> stored;
  {
    Progress progress("upload", "points", outgoing->point_count, session->json);
    stored = UploadScan(session, *outgoing, [&](std::int64_t count) { progress.Add(count); });
  }
  if (!stored.ok()) return stored.status();
  if (session->json) {
    PrintJson(*stored);
    return absl::OkStatus();
  }
  PrintScan(*session, stored->scan(), RotaryLetters(*machine));
  if (stored->already_stored()) std::cout << "it was stored before, with the same content\n";
  return absl::OkStatus();
}

void AddUpload(Command* scan, Session* session) {
  const auto arguments = std::make_shared<UploadArguments>();
  Command* upload = scan->AddCommand("upload", "Uploads one scan; it is durable when the command is done");
  upload->AddOption("FILE", &arguments->file, "Sensor frame: .drc, .ply, .pcd, .xyz; in mm, a snapshot in --unit")
      ->Required();
  upload->AddOption("--machine", &arguments->machine, "The machine that scanned")->Required();
  upload->AddOption("--subject", &arguments->subject, "blade:SERIAL or artefact:ID")->Required();
  upload->AddOption("--kind", &arguments->kind, kScanKinds)->Required();
  upload->AddOption("--v0-mm", &arguments->v0_mm, "Machine position at the start of the scan: X,Y,Z")
      ->Required()
      ->List();
  for (const auto& [option, command_deg] :
       {std::pair{"--a-deg", &arguments->commands.a_deg}, std::pair{"--b-deg", &arguments->commands.b_deg},
        std::pair{"--c-deg", &arguments->commands.c_deg}})
    upload->AddOption(option, command_deg, "Rotary axis as commanded; wanted of each that the part rides on");
  upload->AddOption("--cloud", &arguments->cloud, "profiles (the default) of a line scanner, or snapshot")
      ->OneOf({"profiles", "snapshot"});
  upload
      ->AddOption("--unit", &arguments->unit, "Of a snapshot's coordinates, which its file does not say: mm, m or inch")
      ->OneOf({"mm", "m", "inch"});
  upload->AddOption("--pitch-mm", &arguments->pitch_mm, "Encoder distance between profiles; wanted of them");
  upload->AddOption("--columns", &arguments->columns,
                    "Sensor columns in a profile; without it, the machine's sensor says");
  upload
      ->AddOption("--error-bound-um", &arguments->error_bound_um,
                  "Greatest coordinate error that storing may add; without it, 0.25")
      ->Positive();
  upload->AddOption("--arm-series", &arguments->arm_series,
                    "Another name with every swing of the sensor's arm; scans of two are not registered together");
  upload->AddOption("--clamping", &arguments->clamping,
                    "Another name with every clamping; scans of two are not registered together");
  upload->AddOption("--station", &arguments->station,
                    "Where in the fixture the blade stands; wanted where its part has stations");
  upload->AddOption("--temperature-c", &arguments->temperature_c, "Of what was scanned; it is reported at 20 C");
  upload->AddOption("--scales-temperature-c", &arguments->scales_temperature_c, "Of the machine's scales");
  upload->AddOption("--sensor-serial-number", &arguments->sensor_serial_number, "Of the scanner");
  upload->AddOption("--travel", &arguments->travel, "Which way the encoder went: forward or backward")
      ->OneOf({"forward", "backward"});
  upload->AddOption("--scan-id", &arguments->scan_id,
                    "Id of the scan; the same again is the same scan. Without it: a new one");
  session->OnCommand(upload, [session, arguments] { return Upload(session, *arguments); });
}

void AddList(Command* scan, Session* session) {
  AddListCommand<ScanService>(
      scan, session, "Lists scans, newest first", "ingest", &ScanService::Stub::ListScans,
      ingest::v1::ListScansRequest(),
      Table({"scan", "kind", "subject", "machine", ">bed axis deg", ">carried axis deg", ">points", ">bytes",
             "received"}),
      &ingest::v1::ListScansResponse::scans, [](const ingest::v1::Scan& entry) {
        const ingest::v1::ScanHeader& header = entry.header();
        return Cells{IdText(entry.name()),          ScanKindText(header.kind()),   header.subject(),
                     IdText(header.machine()),      Fixed(header.a_deg(), 3),      Fixed(header.b_deg(), 3),
                     Grouped(header.point_count()), Grouped(entry.stored_bytes()), TimeText(entry.received_at())};
      });
}

// "100:50" -> profiles 100 to 149; "100:" and "100" -> all from 100 on.
absl::StatusOr<clients::ProfileRange> RangeOf(const std::string& text) {
  clients::ProfileRange range;
  const auto refusal = [&] { return runtime::Refuse("--profiles", text, "FIRST:COUNT, FIRST from 0, COUNT from 1"); };
  const char* const end = text.data() + text.size();
  const auto first = std::from_chars(text.data(), end, range.first);
  if (first.ec != std::errc() || range.first < 0) return refusal();
  if (first.ptr == end || (*first.ptr == ':' && first.ptr + 1 == end)) return range;
  if (*first.ptr != ':') return refusal();
  const auto count = std::from_chars(first.ptr + 1, end, range.count);
  if (count.ec != std::errc() || count.ptr != end || range.count < 1) return refusal();
  return range;
}

// Where points are written, and how; found wrong before any is fetched.
struct PointsFile {
  std::string name;
  CloudWriter writer = nullptr;
};
absl::StatusOr<PointsFile> PointsFileOf(const Session& session, const std::string& out) {
  if (absl::Status status = CheckOut(session, out); !status.ok()) return status;
  const absl::StatusOr<CloudWriter> writer = CloudWriterFor(out);
  if (!writer.ok()) return writer.status();
  return PointsFile{out, *writer};
}

absl::Status WritePoints(const Session& session, const PointsFile& file, const metrology::Points& points_mm,
                         std::int64_t of_point_count) {
  absl::Status status = WriteOut(file.name, file.writer(points_mm));
  if (!status.ok()) return status;
  const auto count = static_cast<std::int64_t>(points_mm.size());
  if (session.json) {
    PrintJson({{"file", file.name}, {"point_count", count}, {"of_point_count", of_point_count}});
  } else {
    BesideOut(file.name) << Grouped(count) << (count == of_point_count ? "" : " of " + Grouped(of_point_count))
                         << " points written to " << OutText(file.name) << "\n";
  }
  return status;
}

struct DownloadArguments {
  std::string id, out, profiles;
  int point_count = 0;  // of a preview
};

absl::Status Download(Session* session, const DownloadArguments& arguments) {
  const absl::StatusOr<PointsFile> file = PointsFileOf(*session, arguments.out);
  if (!file.ok()) return file.status();
  std::optional<clients::ProfileRange> range;
  if (!arguments.profiles.empty()) {
    const absl::StatusOr<clients::ProfileRange> given = RangeOf(arguments.profiles);
    if (!given.ok()) return given.status();
    range = *given;
  }
  absl::StatusOr<clients::FetchedScan> fetched;
  {
    const Elapsed elapsed("downloading " + arguments.id, session->json);
    fetched = DownloadScan(session, NameText("scans", arguments.id), range);
  }
  if (!fetched.ok()) return fetched.status();
  return WritePoints(*session, *file, fetched->scan.points_mm, fetched->record.header().point_count());
}

absl::StatusOr<metrology::Points> PreviewPoints(const ingest::v1::PreviewScanResponse& response) {
  const std::string& bytes = response.xyz_f32();
  constexpr std::size_t kPointBytes = 3 * sizeof(float);
  if (bytes.size() != kPointBytes * static_cast<std::size_t>(std::max(response.point_count(), 0)))
    return absl::DataLossError("a preview whose bytes do not hold its points");
  metrology::Points points_mm(bytes.size() / kPointBytes);
  for (std::size_t i = 0; i < points_mm.size(); ++i) {
    Eigen::Vector3f point_mm;
    std::memcpy(point_mm.data(), bytes.data() + kPointBytes * i, kPointBytes);
    points_mm[i] = point_mm.cast<double>();
  }
  return points_mm;
}

absl::Status Preview(Session* session, const DownloadArguments& arguments) {
  const absl::StatusOr<PointsFile> file = PointsFileOf(*session, arguments.out);
  if (!file.ok()) return file.status();
  ingest::v1::PreviewScanRequest request;
  request.set_name(NameText("scans", arguments.id));
  request.set_point_count(arguments.point_count);
  const absl::StatusOr<ingest::v1::PreviewScanResponse> response = CallAtLength<ScanService>(
      session, "fetching a preview of " + arguments.id, "ingest", &ScanService::Stub::PreviewScan, request);
  if (!response.ok()) return response.status();
  const absl::StatusOr<metrology::Points> points_mm = PreviewPoints(*response);
  if (!points_mm.ok()) return points_mm.status();
  return WritePoints(*session, *file, *points_mm, response->scan().header().point_count());
}

void AddDownload(Command* scan, Session* session) {
  const auto arguments = std::make_shared<DownloadArguments>();
  Command* download = scan->AddCommand("download", "Writes a scan's points, sensor frame, mm");
  download->AddOption("ID", &arguments->id, "The scan")->Required();
  AddOutOption(download, &arguments->out, ".ply or .xyz")->Required();
  download->AddOption("--profiles", &arguments->profiles, "Only these, FIRST:COUNT, counted from 0");
  session->OnCommand(download, [session, arguments] { return Download(session, *arguments); });
}

void AddPreview(Command* scan, Session* session) {
  const auto arguments = std::make_shared<DownloadArguments>();
  Command* preview = scan->AddCommand("preview", "Writes every n-th of a scan's points: enough for a picture");
  preview->AddOption("ID", &arguments->id, "The scan")->Required();
  AddOutOption(preview, &arguments->out, ".ply or .xyz")->Required();
  preview->AddOption("--points", &arguments->point_count, "At most so many, to 200000; without it, 20000")->Positive();
  session->OnCommand(preview, [session, arguments] { return Preview(session, *arguments); });
}

}  // namespace

void AddScanCommands(Command* app, Session* session) {
  Command* scan = app->AddCommand("scan", "Scans: upload, look, download, preview, delete points");
  scan->RequireCommand();
  AddUpload(scan, session);
  AddList(scan, session);
  AddDownload(scan, session);
  AddPreview(scan, session);
  AddDeletePointsCommand(scan, session);

  const auto id = std::make_shared<std::string>();
  Command* show = scan->AddCommand("show", "Shows a scan's record");
  show->AddOption("ID", id.get(), "The scan")->Required();
  session->OnCommand(show, [session, id]() -> absl::Status {
    ingest::v1::GetScanRequest request;
    request.set_name(NameText("scans", *id));
    ingest::v1::Scan response;
    absl::Status status = session->Call<ScanService>("ingest", &ScanService::Stub::GetScan, request, &response);
    if (!status.ok()) return status;
    const absl::StatusOr<plant::v1::Machine> machine = FetchMachine(session, response.header().machine());
    if (!machine.ok()) return machine.status();
    PrintScan(*session, response, RotaryLetters(*machine));
    return status;
  });
}

}  // namespace sixpoint::cli
