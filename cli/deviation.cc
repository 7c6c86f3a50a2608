// `sixpoint deviation`: how far a blade's surface is off its CAD, place by place.
#include <cmath>
#include <filesystem>

#include "cli/commands.h"
#include "cli/deviation_document.h"
#include "cli/download_command.h"
#include "cli/number_format.h"
#include "cli/reports.h"
#include "metrology/cloud/deviation_cloud.h"
#include "sixpoint/inspection/v1/deviation.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using inspection::v1::DeviationMap;
using inspection::v1::DeviationService;

std::string PlaceText(const inspection::v1::PatchDeviation& patch) {
  return Fixed(patch.mean_um(), 1) + " +- " + Fixed(patch.expanded_uncertainty_um(), 1) + " at " +
         PointText(patch.centre_in_part_mm(), 2);
}

std::string StatisticsText(const DeviationMap& map) {
  Table table({"region", ">area mm2", ">seen %", ">points", ">mean um", ">rms um", ">p05 um", ">p50 um", ">p95 um",
               "lowest um", "highest um"});
  for (const auto& one : map.statistics()) {
    Cells cells = {one.region().empty() ? "(whole)" : one.region(), Fixed(one.area_mm2(), 1),
                   Fixed(100 * one.seen_area_mm2() / one.area_mm2(), 1), Grouped(one.point_count())};
    if (one.has_mean_um())
      cells.insert(cells.end(),
                   {Fixed(one.mean_um(), 2), Fixed(one.rms_um(), 2), Fixed(one.p05_um(), 1), Fixed(one.p50_um(), 1),
                    Fixed(one.p95_um(), 1), PlaceText(one.lowest()), PlaceText(one.highest())});
    else
      cells.push_back("not seen");
    table.AddRow(std::move(cells));
  }
  return table.ToText();
}

std::string ProfilesText(const DeviationMap& map) {
  if (map.profiles().empty()) return "";
  Table table({"profile", "region", "zone", ">lower mm", ">upper mm", "verdict", ">seen %", ">out mm2", ">areas",
               "lowest um", "highest um", "reason"});
  for (const auto& one : map.profiles()) {
    const auto& tolerance = one.tolerance();
    table.AddRow({tolerance.characteristic(), tolerance.region().empty() ? "(whole)" : tolerance.region(),
                  EnumText(inspection::v1::ProfileZone_Name(tolerance.zone()), "PROFILE_ZONE_"),
                  Fixed(tolerance.lower_mm(), 3), Fixed(tolerance.upper_mm(), 3), VerdictName(one.verdict()),
                  Fixed(100 * one.coverage(), 1), Fixed(one.out_mm2(), 2), std::to_string(one.area_count()),
                  one.has_lowest() ? PlaceText(one.lowest()) : "not seen",
                  one.has_highest() ? PlaceText(one.highest()) : "", one.reason()});
  }
  return table.ToText();
}

std::string BudgetText(const DeviationMap& map) {
  Table table({"what makes a mean uncertain", ">u um", ">share %"});
  for (const auto& one : map.budget())
    table.AddRow({one.source(), Fixed(one.standard_uncertainty_um(), 3), Fixed(100 * one.share(), 1)});
  return table.ToText();
}

std::string DeviationText(const DeviationMap& map) {
  std::string head =
      map.name() + " of " + map.blade() + " by " + map.registration() + " (" + MethodText(map.method()) + ")";
  if (map.verdict() != inspection::v1::VERDICT_UNSPECIFIED)
    head += ": " + VerdictName(map.verdict()) + " (" + map.decision_rule() + ")";
  const auto& points = map.points();
  return head + "\n" + StatisticsText(map) + ProfilesText(map) + BudgetText(map) + std::to_string(map.patch_count()) +
         " patches of " + Significant(map.patch_mm()) + " mm; " + Grouped(points.compared()) + " points compared, " +
         Grouped(points.at_edges()) + " at edges, " + Grouped(points.set_aside()) + " at pins, " +
         Grouped(points.far_off()) + " farther than 1 mm\n" + (map.cloud_sha256().empty() ? "no cloud is kept\n" : "");
}

void AddMapCommand(Command* deviation, Session* session) {
  struct Arguments {
    std::string registration, tolerances;
    std::optional<double> patch_mm;
    std::vector<double> profile_mm;
    bool form = false, without_cloud = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  Command* map = deviation->AddCommand("map", "Compares a registered blade's points with its CAD; done means compared");
  map->AddOption("REGISTRATION", &arguments->registration, "The registration that says how the blade stands")
      ->Required();
  map->AddOption("--patch-mm", &arguments->patch_mm, "Edge of a patch; without it 1");
  map->AddOption("--tolerances", &arguments->tolerances, "YAML or JSON file of regions and profile tolerances");
  map->AddOption("--profile", &arguments->profile_mm, "LOWER,UPPER: profile tolerance of the whole surface, mm")
      ->List();
  map->AddFlag("--form", &arguments->form, "With --profile: of form only, the zone fits the surface best");
  map->AddFlag("--without-cloud", &arguments->without_cloud, "Keep no cloud of the points' deviations");
  session->OnCommand(map, [session, arguments]() -> absl::Status {
    inspection::v1::MapDeviationRequest request;
    request.set_registration(NameText("registrations", arguments->registration));
    request.set_request_id(NewRequestId());
    if (arguments->patch_mm) request.set_patch_mm(*arguments->patch_mm);
    if (!arguments->tolerances.empty())
      if (absl::Status read = ReadDeviationDocument(arguments->tolerances, &request); !read.ok()) return read;
    if (!arguments->profile_mm.empty()) {
      if (arguments->profile_mm.size() != 2)
        return runtime::Refuse("--profile", std::to_string(arguments->profile_mm.size()) + " numbers", "LOWER,UPPER");
      auto& profile = *request.add_profiles();
      profile.set_characteristic("profile");
      profile.set_zone(arguments->form ? inspection::v1::PROFILE_ZONE_FORM
                                       : inspection::v1::PROFILE_ZONE_FORM_AND_LOCATION);
      profile.set_lower_mm(arguments->profile_mm[0]);
      profile.set_upper_mm(arguments->profile_mm[1]);
    } else if (arguments->form) {
      return runtime::Refuse("--form", "without --profile", "--profile LOWER,UPPER with it");
    }
    request.set_without_cloud(arguments->without_cloud);
    return CallAndPrint<DeviationService>(session, "inspection", &DeviationService::Stub::MapDeviation, request,
                                          DeviationText, "comparing the surface with its CAD")
        .status();
  });
}

std::string CsvOf(const inspection::v1::DeviationPatches& patches) {
  std::string csv;
  for (int i = 0; i < patches.areas_mm2_size(); ++i) {
    for (int k = 0; k < 3; ++k) csv += ShortestNumber(patches.centres_in_part_mm(3 * i + k)) + ",";
    for (int k = 0; k < 3; ++k) csv += ShortestNumber(patches.normals_in_part(3 * i + k)) + ",";
    csv += ShortestNumber(patches.areas_mm2(i)) + "," + std::to_string(patches.point_counts(i)) + "," +
           ShortestNumber(patches.means_um(i)) + "," + ShortestNumber(patches.expanded_uncertainties_um(i)) + "\n";
  }
  return csv;
}

absl::StatusOr<std::string> FetchDeviationPatches(Session* session, const std::string& name, const std::string&) {
  inspection::v1::DownloadDeviationPatchesRequest request;
  request.set_name(name);
  return FetchContent<DeviationService>(
      session, "downloading " + name, "inspection", &DeviationService::Stub::DownloadDeviationPatches, request,
      "x_mm,y_mm,z_mm,normal_x,normal_y,normal_z,area_mm2,point_count,mean_um,expanded_uncertainty_um\n",
      [](const inspection::v1::DeviationPatches& some) { return CsvOf(some); });
}

// With the deviation as a scalar beside each point, as viewers of clouds show it in colours.
std::string PlyOf(const metrology::DeviationPoints& points) {
  std::string ply =
      "ply\nformat binary_little_endian 1.0\ncomment part frame, mm; deviation_um positive outside\nelement vertex " +
      std::to_string(points.in_part_mm.size()) +
      "\nproperty double x\nproperty double y\nproperty double z\nproperty float deviation_um\nend_header\n";
  for (std::size_t i = 0; i < points.in_part_mm.size(); ++i) {
    const auto deviation_um = static_cast<float>(1e3 * points.deviations_mm[i]);
    ply.append(reinterpret_cast<const char*>(points.in_part_mm[i].data()), 3 * sizeof(double));
    ply.append(reinterpret_cast<const char*>(&deviation_um), sizeof deviation_um);
  }
  return ply;
}

std::string CsvOf(const metrology::DeviationPoints& points) {
  std::string csv = "x_mm,y_mm,z_mm,deviation_um\n";
  for (std::size_t i = 0; i < points.in_part_mm.size(); ++i) {
    const Eigen::Vector3d& point = points.in_part_mm[i];
    csv += Fixed(point.x(), 4) + "," + Fixed(point.y(), 4) + "," + Fixed(point.z(), 4) + "," +
           Fixed(1e3 * points.deviations_mm[i], 2) + "\n";
  }
  return csv;
}

absl::StatusOr<std::string> FetchDeviationCloud(Session* session, const std::string& name, const std::string& out) {
  inspection::v1::DownloadDeviationCloudRequest request;
  request.set_name(name);
  metrology::DeviationPoints points;
  const auto take = [&](const inspection::v1::DeviationCloudBlock& block) {
    const auto decoded = metrology::DecodeDeviations(block.draco(), block.point_count());
    if (!decoded.ok()) return decoded.status();
    points.in_part_mm.insert(points.in_part_mm.end(), decoded->in_part_mm.begin(), decoded->in_part_mm.end());
    points.deviations_mm.insert(points.deviations_mm.end(), decoded->deviations_mm.begin(),
                                decoded->deviations_mm.end());
    return absl::OkStatus();
  };
  absl::Status fetched = FetchEach<DeviationService>(
      session, "downloading " + name, "inspection", &DeviationService::Stub::DownloadDeviationCloud, request,
      [&] { points = {}; }, take);
  if (!fetched.ok()) return fetched;
  if (points.in_part_mm.empty()) return absl::NotFoundError(name + ": no cloud was kept with it");
  return std::filesystem::path(out).extension() == ".ply" ? PlyOf(points) : CsvOf(points);
}

}  // namespace

void AddDeviationCommands(Command* app, Session* session) {
  Command* deviation = app->AddCommand("deviation", "How far blades' surfaces are off their CAD");
  deviation->RequireCommand();
  AddMapCommand(deviation, session);
  AddListCommand<DeviationService>(
      deviation, session, "Lists deviation maps, newest first", "inspection",
      &DeviationService::Stub::ListDeviationMaps, inspection::v1::ListDeviationMapsRequest(),
      Table({"deviation", "blade", "positioned by", "verdict", ">seen %", ">rms um", "by", "recorded"}),
      &inspection::v1::ListDeviationMapsResponse::deviations, [](const DeviationMap& map) {
        const auto& whole = map.statistics(0);
        return Cells{IdText(map.name()),
                     IdText(map.blade()),
                     MethodText(map.method()),
                     map.profiles().empty() ? "-" : VerdictName(map.verdict()),
                     Fixed(100 * whole.seen_area_mm2() / whole.area_mm2(), 1),
                     Fixed(whole.rms_um(), 2),
                     map.requested_by(),
                     TimeText(map.recorded_at())};
      });
  const auto id = std::make_shared<std::string>();
  Command* show = deviation->AddCommand("show", "Shows a deviation map region by region");
  show->AddOption("ID", id.get(), "The deviation map")->Required();
  session->OnCommand(show, [session, id] {
    inspection::v1::GetDeviationMapRequest request;
    request.set_name(NameText("deviations", *id));
    return CallAndPrint<DeviationService>(session, "inspection", &DeviationService::Stub::GetDeviationMap, request,
                                          DeviationText)
        .status();
  });
  AddDownloadCommand(deviation, session, {"patches", "Writes a map's patches, seen or not", "CSV file"},
                     "The deviation map", "deviations", FetchDeviationPatches);
  AddDownloadCommand(
      deviation, session,
      {"points", "Writes a map's points with their deviations", ".ply, with the deviation as a scalar, or else CSV"},
      "The deviation map", "deviations", FetchDeviationCloud);
}

}  // namespace sixpoint::cli
