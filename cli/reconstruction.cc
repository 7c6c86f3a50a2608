// `sixpoint reconstruction`: the shape that a blank contains.
#include <algorithm>
#include <cstdlib>
#include <map>

#include "cli/commands.h"
#include "cli/download_command.h"
#include "cli/number_format.h"
#include "cli/out_file.h"
#include "cli/reports.h"
#include "sixpoint/correction/v1/reconstruction.grpc.pb.h"

namespace sixpoint::cli {
namespace {

using correction::v1::Reconstruction;
using correction::v1::ReconstructionService;

std::string OutcomeText(const Reconstruction& made) {
  return EnumText(correction::v1::ReconstructionOutcome_Name(made.outcome()), "RECONSTRUCTION_OUTCOME_");
}

std::string KindText(const plant::v1::ShapeRegion& region) {
  return EnumText(plant::v1::ShapeRegionKind_Name(region.kind()), "SHAPE_REGION_KIND_");
}

std::string RegionsText(const Reconstruction& made) {
  Table table({"region", "kind", ">allowance mm", ">band mm", ">seen %", ">least stock um", ">beyond wanted um",
               ">of the band %", ">off fixed um", ">datum um"});
  const auto number = [](bool has, double value, int places) { return has ? Fixed(value, places) : std::string("-"); };
  for (const auto& one : made.regions()) {
    const plant::v1::ShapeRegion& region = one.region();
    table.AddRow({region.region(), KindText(region), number(region.has_allowance_mm(), region.allowance_mm(), 3),
                  region.has_lower_mm() ? Fixed(region.lower_mm(), 3) + " to " + Fixed(region.upper_mm(), 3) : "-",
                  Fixed(100 * one.seen_part(), 1), number(one.has_least_allowance_um(), one.least_allowance_um(), 1),
                  number(one.has_least_spare_um(), one.least_spare_um(), 1), Fixed(100 * one.greatest_band_use(), 1),
                  number(one.has_worst_fixed_um(), one.worst_fixed_um(), 2),
                  number(one.has_worst_datum_um(), one.worst_datum_um(), 2)});
  }
  return table.ToText();
}

std::string ProofText(const correction::v1::ShapeProof& proof) {
  std::string text = std::string("proven: ") +
                     (proof.of_any_shape() ? "no shape of any kind" : "no shape of the finest lattice") +
                     "; limits lack " + Fixed(proof.lacking_um(), 1) + " um\n";
  const auto cure = [&](const char* what, bool has, const correction::v1::LeastRelaxation& relaxation) {
    text += std::string("  ") + what + " alone: " +
            (has ? "at least " + Fixed(relaxation.at_least_um(), 1) + " um more; with " +
                       Fixed(relaxation.at_most_um(), 1) + " um there is a shape\n"
                 : "no cure\n");
  };
  cure("wider tolerances", proof.has_tolerance(), proof.tolerance());
  cure("stock", proof.has_stock(), proof.stock());
  return text;
}

std::string HoldingText(const Reconstruction& made) {
  constexpr int kMost = 10;
  if (made.holding().empty()) return "";
  const bool found = made.outcome() == correction::v1::RECONSTRUCTION_OUTCOME_RECONSTRUCTED;
  Table table(
      {found ? "held by" : "contradicts", "side", "region", ">x mm", ">y mm", ">z mm", ">limit mm", ">share %"});
  for (int i = 0; i < std::min(kMost, made.holding_size()); ++i) {
    const correction::v1::HoldingPlace& one = made.holding(i);
    table.AddRow({EnumText(correction::v1::ShapeLimit_Name(one.limit()), "SHAPE_LIMIT_"),
                  one.upper() ? "upper" : "lower", one.region(), Fixed(one.place_in_part_mm().x_mm(), 2),
                  Fixed(one.place_in_part_mm().y_mm(), 2), Fixed(one.place_in_part_mm().z_mm(), 2),
                  Fixed(one.limit_mm(), 4), Fixed(100 * one.share(), 1)});
  }
  const int more = made.holding_size() - kMost;
  return table.ToText() + (more > 0 ? std::to_string(more) + " places more: --json\n" : "");
}

std::string ReconstructionText(const Reconstruction& made) {
  std::string text = made.name() + " of " + made.blade() + " by " + made.registration() + " (" +
                     MethodText(made.registration_method()) + "): " + OutcomeText(made) +
                     (made.of_part_limits() ? "" : ", with other limits than the part's: a try") + "\n";
  if (!made.remark().empty()) text += made.remark() + "\n";
  text += RegionsText(made);
  if (made.has_proof()) text += ProofText(made.proof());
  if (made.has_worst_step_um())
    text += "beside what is not cut: step " + Fixed(made.worst_step_um(), 2) + " um, kink " +
            Fixed(made.worst_kink_deg(), 3) + " deg\n";
  text += HoldingText(made);
  return text + std::to_string(made.patch_count()) + " patches of " + Significant(made.method().patch_mm()) +
         " mm; lattice of " + Significant(made.spacing_mm()) + " mm cells, " + Grouped(made.control_count()) +
         " controls; " + Grouped(made.points().taken()) + " points taken, " + Grouped(made.points().far_off()) +
         " far off, " + Grouped(made.points().shapeless()) + " without a surface\n";
}

// REGION=MM, each: the name may have a = in it, the number not.
absl::Status ReadTried(const std::string& option, const std::vector<std::string>& values,
                       void (correction::v1::TriedLimits::*set)(double),
                       std::map<std::string, correction::v1::TriedLimits>* tried) {
  for (const std::string& value : values) {
    const std::size_t equals = value.rfind('=');
    char* end = nullptr;
    const double mm = equals == std::string::npos ? 0 : std::strtod(value.c_str() + equals + 1, &end);
    if (end == nullptr || end == value.c_str() + equals + 1 || *end != '\0' || equals == 0)
      return runtime::Refuse(option, value, "REGION=MM");
    correction::v1::TriedLimits& limits = (*tried)[value.substr(0, equals)];
    limits.set_region(value.substr(0, equals));
    (limits.*set)(mm);
  }
  return absl::OkStatus();
}

struct MakeArguments {
  std::string registration;
  std::vector<std::string> allowances, lowers, uppers;
  std::optional<double> patch_mm, farthest_mm, coarsest_mm, finest_mm, blend_mm, coverage_factor;
};

absl::StatusOr<correction::v1::ReconstructRequest> RequestOf(const MakeArguments& arguments) {
  using correction::v1::TriedLimits;
  correction::v1::ReconstructRequest request;
  request.set_registration(NameText("registrations", arguments.registration));
  request.set_request_id(NewRequestId());
  std::map<std::string, TriedLimits> tried;
  absl::Status status = ReadTried("--allowance", arguments.allowances, &TriedLimits::set_allowance_mm, &tried);
  if (status.ok()) status = ReadTried("--lower", arguments.lowers, &TriedLimits::set_lower_mm, &tried);
  if (status.ok()) status = ReadTried("--upper", arguments.uppers, &TriedLimits::set_upper_mm, &tried);
  if (!status.ok()) return status;
  for (const auto& [region, limits] : tried) *request.add_tried_limits() = limits;
  correction::v1::ReconstructionMethod& method = *request.mutable_method();
  if (arguments.patch_mm) method.set_patch_mm(*arguments.patch_mm);
  if (arguments.farthest_mm) method.set_farthest_mm(*arguments.farthest_mm);
  if (arguments.coarsest_mm) method.set_coarsest_spacing_mm(*arguments.coarsest_mm);
  if (arguments.finest_mm) method.set_finest_spacing_mm(*arguments.finest_mm);
  if (arguments.blend_mm) method.set_blend_mm(*arguments.blend_mm);
  if (arguments.coverage_factor) method.set_coverage_factor(*arguments.coverage_factor);
  return request;
}

void AddMakeCommand(Command* reconstruction, Session* session) {
  const auto arguments = std::make_shared<MakeArguments>();
  Command* make = reconstruction->AddCommand(
      "make",
      "Finds the shape within its tolerances that a registered blank contains; 4: there is none, or too little "
      "was seen");
  make->AddOption("REGISTRATION", &arguments->registration, "The registration that says how the blank stands")
      ->Required();
  make->AddOption("--allowance", &arguments->allowances, "REGION=MM: tries another stock than the part's; repeatable");
  make->AddOption("--lower", &arguments->lowers, "REGION=MM: tries another lower profile limit; repeatable");
  make->AddOption("--upper", &arguments->uppers, "REGION=MM: tries another upper profile limit; repeatable");
  make->AddOption("--patch-mm", &arguments->patch_mm, "Width of the blank's patches; without it 0.5");
  make->AddOption("--farthest-mm", &arguments->farthest_mm,
                  "A point farther from the CAD is of something else; without it 1.5");
  make->AddOption("--coarsest-mm", &arguments->coarsest_mm, "Cells of the first lattice; without it 4");
  make->AddOption("--finest-mm", &arguments->finest_mm, "Cells of the last lattice; without it 2");
  make->AddOption("--blend-mm", &arguments->blend_mm,
                  "Beside fixed surface the stock rises from none over so much; without it 4");
  make->AddOption("--coverage-factor", &arguments->coverage_factor,
                  "Stock is wanted beyond the allowance by so many standard uncertainties; without it 3");
  session->OnCommand(make, [session, arguments]() -> absl::Status {
    const auto request = RequestOf(*arguments);
    if (!request.ok()) return request.status();
    const auto made =
        CallAndPrint<ReconstructionService>(session, "correction", &ReconstructionService::Stub::Reconstruct, *request,
                                            ReconstructionText, "fitting the shape into the blank");
    if (made.ok() && made->outcome() != correction::v1::RECONSTRUCTION_OUTCOME_RECONSTRUCTED) session->MarkNotUsable();
    return made.status();
  });
}

std::string CsvOf(const correction::v1::BlankPatches& patches, const Reconstruction& made) {
  std::string csv;
  for (int i = 0; i < patches.stock_um_size(); ++i) {
    for (int k = 0; k < 3; ++k) csv += ShortestNumber(patches.points_in_part_mm(3 * i + k)) + ",";
    for (int k = 0; k < 3; ++k) csv += ShortestNumber(patches.normals_in_part(3 * i + k)) + ",";
    const int region = patches.regions(i);
    csv += ShortestNumber(patches.expanded_uncertainties_um(i)) + "," + ShortestNumber(patches.stock_um(i)) + "," +
           CsvCell(region < made.regions_size() ? made.regions(region).region().region() : "") + "\n";
  }
  return csv;
}

absl::StatusOr<std::string> FetchBlankPatches(Session* session, const std::string& name, const std::string&) {
  correction::v1::GetReconstructionRequest get;
  get.set_name(name);
  Reconstruction made;
  absl::Status status =
      session->Call<ReconstructionService>("correction", &ReconstructionService::Stub::GetReconstruction, get, &made);
  if (!status.ok()) return status;
  correction::v1::DownloadBlankPatchesRequest request;
  request.set_name(name);
  return FetchContent<ReconstructionService>(
      session, "downloading " + name, "correction", &ReconstructionService::Stub::DownloadBlankPatches, request,
      "x_mm,y_mm,z_mm,normal_x,normal_y,normal_z,expanded_uncertainty_um,stock_um,region\n",
      [&](const correction::v1::BlankPatches& some) { return CsvOf(some, made); });
}

absl::StatusOr<std::string> FetchLattice(Session* session, const std::string& name, const std::string&) {
  correction::v1::DownloadLatticeRequest request;
  request.set_name(name);
  return FetchContent<ReconstructionService>(session, "downloading " + name, "correction",
                                             &ReconstructionService::Stub::DownloadLattice, request, "",
                                             [](const correction::v1::LatticePiece& piece) { return piece.lattice(); });
}

}  // namespace

void AddReconstructionCommands(Command* app, Session* session) {
  Command* reconstruction = app->AddCommand("reconstruction", "Shapes that blanks contain which are not their part's");
  reconstruction->RequireCommand();
  AddMakeCommand(reconstruction, session);
  AddListCommand<ReconstructionService>(
      reconstruction, session, "Lists reconstructions, newest first", "correction",
      &ReconstructionService::Stub::ListReconstructions, correction::v1::ListReconstructionsRequest(),
      Table({"reconstruction", "blade", "positioned by", "outcome", "limits", "by", "recorded"}),
      &correction::v1::ListReconstructionsResponse::reconstructions, [](const Reconstruction& made) {
        return Cells{IdText(made.name()),
                     IdText(made.blade()),
                     MethodText(made.registration_method()),
                     OutcomeText(made),
                     made.of_part_limits() ? "the part's" : "a try",
                     made.requested_by(),
                     TimeText(made.recorded_at())};
      });
  const auto id = std::make_shared<std::string>();
  Command* show = reconstruction->AddCommand("show", "Shows a reconstruction region by region");
  show->AddOption("ID", id.get(), "The reconstruction")->Required();
  session->OnCommand(show, [session, id] {
    correction::v1::GetReconstructionRequest request;
    request.set_name(NameText("reconstructions", *id));
    return CallAndPrint<ReconstructionService>(session, "correction", &ReconstructionService::Stub::GetReconstruction,
                                               request, ReconstructionText)
        .status();
  });
  AddDownloadCommand(reconstruction, session, {"patches", "Writes the blank's patches with their stock", "CSV file"},
                     "The reconstruction", "reconstructions", FetchBlankPatches);
  AddDownloadCommand(reconstruction, session,
                     {"lattice", "Writes the deformation (docs/methods/reconstruction.md)", "Binary file"},
                     "The reconstruction", "reconstructions", FetchLattice);
}

}  // namespace sixpoint::cli
