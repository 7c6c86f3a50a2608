// Before Debian's header of this name, for programs built for the thread sanitizer only: there protobuf gives its map fields eight
// more bytes to find races of its own with, and Debian's library, which is not built so, would read past and beside them.
#include <google/protobuf/message.h>  // what it includes keeps the macro: the standard library's reference counts ask for it
#pragma push_macro("__SANITIZE_THREAD__")
#undef __SANITIZE_THREAD__
#include_next <google/protobuf/map_field.h>
#pragma pop_macro("__SANITIZE_THREAD__")
