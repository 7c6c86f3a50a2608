// Each generated source of messages has two names of its own that another has too; where several are compiled as one, they are told
// apart by the source that CMake names in SIXPOINT_GENERATED_SOURCE.
#pragma once

#define SIXPOINT_JOINED(name, source) name##source
#define SIXPOINT_NAME_IN(name, source) SIXPOINT_JOINED(name, source)
#define schemas SIXPOINT_NAME_IN(schemas_of_, SIXPOINT_GENERATED_SOURCE)
#define file_default_instances SIXPOINT_NAME_IN(default_instances_of_, SIXPOINT_GENERATED_SOURCE)
