// What a machine asks of the plant on a blade's way, as messages. request_id is filled in.
#pragma once

#include <string>
#include <vector>

#include "simulator/artefact.h"
#include "simulator/blade.h"
#include "simulator/machine.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/registration/v1/measuring_plan.pb.h"

namespace sixpoint::simulator {

// The scans are added by who makes them.
calibration::v1::CalibrateSensorRequest SensorRequest(const std::string& machine, const std::string& artefact,
                                                      const TouchProbing& probing, double probe_noise_um);
calibration::v1::CalibrateRotationRequest RotationRequest(const std::string& machine,
                                                          const std::vector<ProbedSphere>& probed);

correction::v1::ReleaseCorrectionRequest ReleaseRequest(const std::string& correction, const std::string& reason);
correction::v1::FetchProgramRequest FetchRequest(const std::string& correction, const std::string& machine,
                                                 const std::string& blade, const std::string& clamping);
// Every hole, now.
correction::v1::ReportCutRequest CutRequest(const std::string& correction, const DesignedPart& part);

registration::v1::PlanMeasurementRequest PlanRequest(const std::string& machine, const std::string& part,
                                                     const std::string& station, bool six_points);
double LeastCoverage(const registration::v1::MeasuringPlan& plan);  // of its regions
// What a measuring plan has the scanner do, sweep by sweep: a scan of each portion, its header as the portion states it, from the encoder's 0 to
// the portion's length.
std::vector<ScanPlan> ScansOf(const registration::v1::MeasuringPlan& plan, double pitch_mm);

// By how much the two put the worst of these points apart.
double WorstPlace_um(const Eigen::Isometry3d& one, const Eigen::Isometry3d& other,
                     const std::vector<Eigen::Vector3d>& points_mm);
// Where the corrected program starts each hole, and where it should on that machine: the worst.
double WorstStart_um(const correction::v1::Correction& correction, const DesignedPart& part, const MachineTruth& truth,
                     const Eigen::Isometry3d& zero_from_part);

}  // namespace sixpoint::simulator
