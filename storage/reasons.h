// Why a statement or the object store failed, for programs: names of sixpoint.errors.v1.ErrorReason, which storage cannot
// include. A test of services/runtime holds them against it.
#pragma once

namespace sixpoint::storage {

inline constexpr char kBucketMissing[] = "BUCKET_MISSING";
inline constexpr char kBucketOfAnother[] = "BUCKET_OF_ANOTHER";
inline constexpr char kCalibrationDecidedMeanwhile[] = "CALIBRATION_DECIDED_MEANWHILE";
inline constexpr char kCalibrationWithdrawn[] = "CALIBRATION_WITHDRAWN";
inline constexpr char kClearanceMissing[] = "CLEARANCE_MISSING";
inline constexpr char kCloudStoreFull[] = "CLOUD_STORE_FULL";
inline constexpr char kCorrectionDecidedMeanwhile[] = "CORRECTION_DECIDED_MEANWHILE";
inline constexpr char kDatabaseDamaged[] = "DATABASE_DAMAGED";
inline constexpr char kObjectStoreAway[] = "OBJECT_STORE_AWAY";
inline constexpr char kObjectStoreMissing[] = "OBJECT_STORE_MISSING";
inline constexpr char kObjectStoreRefused[] = "OBJECT_STORE_REFUSED";
inline constexpr char kOfAnotherPart[] = "OF_ANOTHER_PART";
inline constexpr char kPointsDeleted[] = "POINTS_DELETED";
inline constexpr char kProgramNotReleased[] = "PROGRAM_NOT_RELEASED";
inline constexpr char kRequestIdReused[] = "REQUEST_ID_REUSED";
inline constexpr char kTransactionConflict[] = "TRANSACTION_CONFLICT";
inline constexpr char kWebhookExists[] = "WEBHOOK_EXISTS";
inline constexpr char kWebhooksFull[] = "WEBHOOKS_FULL";
inline constexpr char kWorkOrderDiffers[] = "WORK_ORDER_DIFFERS";

inline constexpr const char* kReasons[] = {kBucketMissing,
                                           kBucketOfAnother,
                                           kCalibrationDecidedMeanwhile,
                                           kCalibrationWithdrawn,
                                           kClearanceMissing,
                                           kCloudStoreFull,
                                           kCorrectionDecidedMeanwhile,
                                           kDatabaseDamaged,
                                           kObjectStoreAway,
                                           kObjectStoreMissing,
                                           kObjectStoreRefused,
                                           kOfAnotherPart,
                                           kPointsDeleted,
                                           kProgramNotReleased,
                                           kRequestIdReused,
                                           kTransactionConflict,
                                           kWebhookExists,
                                           kWebhooksFull,
                                           kWorkOrderDiffers};

}  // namespace sixpoint::storage
