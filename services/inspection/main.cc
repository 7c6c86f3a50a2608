// sixpoint-inspection: the verdict on a machined blade.
#include "services/inspection/assessment_service.h"
#include "services/inspection/deviation_service.h"
#include "services/inspection/disposition_service.h"
#include "services/inspection/efficacy_service.h"
#include "services/inspection/export_service.h"
#include "services/inspection/inspection_service.h"
#include "services/inspection/measurement_service.h"
#include "services/inspection/report_service.h"
#include "services/inspection/section_service.h"
#include "services/inspection/value_service.h"
#include "services/runtime/peers.h"
#include "services/runtime/server.h"

namespace sixpoint::inspection {
namespace {

// Each inspection has its own threads and some hundred megabytes; more than two at once only slow each other down.
constexpr runtime::PoolLimits kLimits{2, runtime::kAllLetIn};

std::vector<runtime::ServedService> MakeServices(const runtime::ServerOptions& options, storage::Database* database) {
  // One for all: prepared surfaces are kept once.
  const auto peers = std::make_shared<const clients::BladePeers>(
      runtime::ConnectToPeer(options, "plant"), runtime::ConnectToPeer(options, "ingest"),
      runtime::ConnectToPeer(options, "calibration"), runtime::ConnectToPeer(options, "registration"));
  InspectionServiceOptions compute_options;
  compute_options.pool = kLimits;
  compute_options.threads = options.threads;
  std::vector<runtime::ServedService> services;
  services.push_back({v1::InspectionService::service_full_name(),
                      std::make_unique<InspectionService>(storage::InspectionsIn(database), peers, compute_options)});
  services.push_back({v1::DeviationService::service_full_name(),
                      std::make_unique<DeviationService>(storage::DeviationsIn(database), peers, compute_options)});
  services.push_back({v1::SectionService::service_full_name(),
                      std::make_unique<SectionService>(storage::SectionsIn(database), peers, compute_options)});
  services.push_back({v1::AssessmentService::service_full_name(),
                      std::make_unique<AssessmentService>(
                          storage::AssessmentsIn(database),
                          AssessedStores{storage::InspectionsIn(database), storage::DeviationsIn(database),
                                         storage::SectionsIn(database), storage::MeasurementsIn(database)},
                          peers, compute_options)});
  services.push_back({v1::ExportService::service_full_name(),
                      std::make_unique<ExportService>(storage::InspectionsIn(database), storage::DeviationsIn(database),
                                                      storage::AssessmentsIn(database), peers)});
  services.push_back(
      {v1::MeasurementService::service_full_name(),
       std::make_unique<MeasurementService>(storage::MeasurementsIn(database), storage::MeasurementImportsIn(database),
                                            OurValuesOf(storage::AssessmentsIn(database)), peers)});
  services.push_back(
      {v1::ReportService::service_full_name(),
       std::make_unique<ReportService>(ReportSources{storage::InspectionsIn(database), storage::DeviationsIn(database),
                                                     storage::SectionsIn(database), storage::MeasurementsIn(database),
                                                     AssessmentsOf(storage::AssessmentsIn(database))},
                                       peers)});
  services.push_back(
      {v1::ValueService::service_full_name(), std::make_unique<ValueService>(storage::ValuesIn(database))});
  services.push_back(
      {v1::EfficacyService::service_full_name(), std::make_unique<EfficacyService>(storage::OutcomesIn(database))});
  services.push_back(
      {v1::DispositionService::service_full_name(),
       std::make_unique<DispositionService>(storage::DispositionsIn(database), storage::InspectionsIn(database))});
  return services;
}

}  // namespace
}  // namespace sixpoint::inspection

int main(int argc, char** argv) {
  return sixpoint::runtime::Serve(sixpoint::runtime::ParseServerOptions(argc, argv, "inspection"),
                                  sixpoint::inspection::MakeServices);
}
