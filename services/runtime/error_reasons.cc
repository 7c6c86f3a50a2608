// Each reason has one code.
#include "services/runtime/errors.h"

namespace sixpoint::runtime {

// Exhaustive by its lack of a default: a reason without a code does not compile.
absl::StatusCode CodeOf(ErrorReason reason) {
  switch (reason) {
    case errors::v1::MACHINE_NOT_FOUND:
    case errors::v1::ARTEFACT_NOT_FOUND:
    case errors::v1::PART_NOT_FOUND:
    case errors::v1::BLADE_NOT_FOUND:
    case errors::v1::SCAN_NOT_FOUND:
    case errors::v1::CALIBRATION_NOT_FOUND:
    case errors::v1::STUDY_NOT_FOUND:
    case errors::v1::REGISTRATION_NOT_FOUND:
    case errors::v1::CORRECTION_NOT_FOUND:
    case errors::v1::INSPECTION_NOT_FOUND:
    case errors::v1::RECORD_ENTRY_NOT_FOUND:
    case errors::v1::DELETION_NOT_FOUND:
    case errors::v1::PERSON_NOT_FOUND:
    case errors::v1::SERVICE_MISSING:
    case errors::v1::RENEWAL_NOT_OFFERED:
    case errors::v1::ACCOUNT_NOT_FOUND:
    case errors::v1::CLEARANCE_NOT_FOUND:
      return absl::StatusCode::kNotFound;
    case errors::v1::SCAN_DIFFERS:
    case errors::v1::BLOCK_DIFFERS:
    case errors::v1::ACCOUNT_EXISTS:
      return absl::StatusCode::kAlreadyExists;
    case errors::v1::UPLOAD_OVERTAKEN:
    case errors::v1::TRANSACTION_CONFLICT:
    case errors::v1::CALIBRATION_DECIDED_MEANWHILE:
    case errors::v1::CORRECTION_DECIDED_MEANWHILE:
      return absl::StatusCode::kAborted;
    case errors::v1::CERTIFICATE_MISSING:
    case errors::v1::CERTIFICATE_FOREIGN:
    case errors::v1::CERTIFICATE_EXPIRED:
    case errors::v1::CERTIFICATE_REVOKED:
    case errors::v1::SESSION_NOT_VALID:
    case errors::v1::SESSION_ENDED:
    case errors::v1::SIGN_IN_REFUSED:
      return absl::StatusCode::kUnauthenticated;
    case errors::v1::ROLE_MISSING:
    case errors::v1::MACHINE_DIFFERS:
    case errors::v1::CODE_NOT_VALID:
    case errors::v1::CLEARANCE_MISSING:
      return absl::StatusCode::kPermissionDenied;
    case errors::v1::CALIBRATION_MISSING:
    case errors::v1::CALIBRATION_EXPIRED:
    case errors::v1::CALIBRATION_WITHDRAWN:
    case errors::v1::CALIBRATION_NOT_A_DRAFT:
    case errors::v1::CALIBRATION_UNDETERMINED:
    case errors::v1::CALIBRATION_NOT_CONVERGED:
    case errors::v1::STUDY_UNDETERMINED:
    case errors::v1::AXIS_NOT_CHARACTERISED:
    case errors::v1::REFERENCE_EXPIRED:
    case errors::v1::SENSOR_UNSUITABLE:
    case errors::v1::AXIS_UNCERTAINTY_MISSING:
    case errors::v1::SENSOR_MOVED:
    case errors::v1::KINEMATICS_UNSUITABLE:
    case errors::v1::KINEMATICS_UNSUPPORTED:
    case errors::v1::SIX_POINTS_MISSING:
    case errors::v1::PART_WITHOUT_HOLES:
    case errors::v1::REGISTRATION_NOT_CONVERGED:
    case errors::v1::POSE_OUT_OF_LIMITS:
    case errors::v1::POSE_SINGULAR:
    case errors::v1::CORRECTION_DECIDED:
    case errors::v1::PROGRAM_NOT_RELEASED:
    case errors::v1::PROGRAM_MISSING:
    case errors::v1::CLAMPING_DIFFERS:
    case errors::v1::HOLE_CUT_BEFORE:
    case errors::v1::PROGRAM_NOT_DIVISIBLE:
    case errors::v1::POINTS_DELETED:
    case errors::v1::SURFACE_TOO_LARGE:
    case errors::v1::OBJECT_STORE_MISSING:
    case errors::v1::OBJECT_STORE_REFUSED:
    case errors::v1::BUCKET_MISSING:
    case errors::v1::IDENTITY_PROVIDER_MISSING:
      return absl::StatusCode::kFailedPrecondition;
    case errors::v1::REGISTRATIONS_FULL:
    case errors::v1::BATCHES_FULL:
    case errors::v1::CALIBRATIONS_FULL:
    case errors::v1::STUDIES_FULL:
    case errors::v1::CORRECTIONS_FULL:
    case errors::v1::INSPECTIONS_FULL:
    case errors::v1::UPLOADS_FULL:
    case errors::v1::PREVIEWS_FULL:
    case errors::v1::CAD_WORKERS_BUSY:
    case errors::v1::STORE_CHECKS_FULL:
    case errors::v1::DOWNLOADS_FULL:
    case errors::v1::CALLS_FULL:
    case errors::v1::SIGN_IN_SLOWED:
    case errors::v1::SIGN_INS_FULL:
      return absl::StatusCode::kResourceExhausted;
    case errors::v1::OBJECT_STORE_AWAY:
    case errors::v1::CAD_WORKER_MISSING:
    case errors::v1::SERVICE_NOT_READY:
    case errors::v1::IDENTITY_PROVIDER_AWAY:
      return absl::StatusCode::kUnavailable;
    case errors::v1::SCAN_DAMAGED:
    case errors::v1::BLOCKS_FORGOTTEN:
    case errors::v1::DATABASE_DAMAGED:
      return absl::StatusCode::kDataLoss;
    case errors::v1::ERROR_REASON_UNSPECIFIED:
    case errors::v1::ErrorReason_INT_MIN_SENTINEL_DO_NOT_USE_:
    case errors::v1::ErrorReason_INT_MAX_SENTINEL_DO_NOT_USE_:
      break;
  }
  return absl::StatusCode::kUnknown;
}

}  // namespace sixpoint::runtime
