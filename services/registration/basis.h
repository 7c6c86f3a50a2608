// Which revisions and calibrations a registration rests on: those of now, or those that a recorded one names.
#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <optional>
#include <string>
#include <vector>

#include "services/clients/calibrations.h"
#include "services/clients/parts.h"
#include "services/runtime/call.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::registration {

// The sensor calibration that maps the scans.
struct ChosenSensor {
  clients::FetchedSensorCalibration calibration;
  bool asked = false;     // and it is not the one that was in force when a scan was received
  std::string scan = {};  // that it was chosen by
};

// Of one call.
class Basis {
 public:
  virtual ~Basis() = default;
  // Else what was recorded is computed again, from bytes that are read again.
  virtual bool IsOfNow() const = 0;
  virtual absl::StatusOr<plant::v1::Part> PartOfBlade(const std::string& blade) const = 0;
  virtual absl::StatusOr<plant::v1::Machine> Machine(const std::string& machine) const = 0;
  // Of the first scan.
  virtual absl::StatusOr<ChosenSensor> Sensor(const ingest::v1::Scan& scan) const = 0;
  // Whether it maps that scan, another or the first, too. field: where the scan is named.
  virtual absl::Status CheckMapped(const std::string& field, const ingest::v1::Scan& scan,
                                   ChosenSensor* sensor) const = 0;
  virtual absl::StatusOr<clients::FetchedRotationCalibration> Rotation(const std::string& machine) const = 0;
  // Nothing where none was characterised.
  virtual absl::StatusOr<std::optional<clients::FetchedAxis>> Axis(const std::string& machine,
                                                                   const std::string& letter) const = 0;
  virtual absl::StatusOr<std::optional<clients::FetchedArmStudy>> Arm(const std::string& machine) const = 0;
};

// Newest revisions, calibrations in force; sensor calibrations as in force when each scan was received, or as the request asks. All are
// refused where they do not hold.
class BasisOfNow : public Basis {
 public:
  // All of them live longer.
  BasisOfNow(const clients::PlantClient& plant, const clients::CalibrationClient& calibrations,
             const v1::RegisterRequest& request, const runtime::Caller& caller)
      : plant_(plant), calibrations_(calibrations), request_(request), caller_(caller) {}
  bool IsOfNow() const override { return true; }
  absl::StatusOr<plant::v1::Part> PartOfBlade(const std::string& blade) const override;
  absl::StatusOr<plant::v1::Machine> Machine(const std::string& machine) const override;
  absl::StatusOr<ChosenSensor> Sensor(const ingest::v1::Scan& scan) const override;
  absl::Status CheckMapped(const std::string& field, const ingest::v1::Scan& scan, ChosenSensor* sensor) const override;
  absl::StatusOr<clients::FetchedRotationCalibration> Rotation(const std::string& machine) const override;
  absl::StatusOr<std::optional<clients::FetchedAxis>> Axis(const std::string& machine,
                                                           const std::string& letter) const override;
  absl::StatusOr<std::optional<clients::FetchedArmStudy>> Arm(const std::string& machine) const override;

 private:
  absl::Status CheckMappedAlike(const ingest::v1::Scan& scan, ChosenSensor* sensor) const;

  const clients::PlantClient& plant_;
  const clients::CalibrationClient& calibrations_;
  const v1::RegisterRequest& request_;
  const runtime::Caller& caller_;
};

// What a recorded registration and its entry in the journal name, whatever became of it since.
class BasisOfThen : public Basis {
 public:
  // inputs: the entry's.
  BasisOfThen(const clients::PlantClient& plant, const clients::CalibrationClient& calibrations,
              const v1::Registration& recorded, std::vector<std::string> inputs, const runtime::Caller& caller)
      : plant_(plant), calibrations_(calibrations), recorded_(recorded), inputs_(std::move(inputs)), caller_(caller) {}
  bool IsOfNow() const override { return false; }
  absl::StatusOr<plant::v1::Part> PartOfBlade(const std::string& blade) const override;
  absl::StatusOr<plant::v1::Machine> Machine(const std::string& machine) const override;
  absl::StatusOr<ChosenSensor> Sensor(const ingest::v1::Scan& scan) const override;
  absl::Status CheckMapped(const std::string& field, const ingest::v1::Scan& scan, ChosenSensor* sensor) const override;
  absl::StatusOr<clients::FetchedRotationCalibration> Rotation(const std::string& machine) const override;
  absl::StatusOr<std::optional<clients::FetchedAxis>> Axis(const std::string& machine,
                                                           const std::string& letter) const override;
  absl::StatusOr<std::optional<clients::FetchedArmStudy>> Arm(const std::string& machine) const override;

 private:
  const clients::PlantClient& plant_;
  const clients::CalibrationClient& calibrations_;
  const v1::Registration& recorded_;
  std::vector<std::string> inputs_;
  const runtime::Caller& caller_;
};

// As it was asked for.
v1::RegisterRequest RequestOf(const v1::Registration& recorded);

}  // namespace sixpoint::registration
