// Before asio's header of this name, for programs built for the thread sanitizer only: it knows no fences, and says so where they are compiled.
// asio's own locks order what its handlers share; these it knows.
#define BOOST_ASIO_DISABLE_FENCED_BLOCK
#include_next <boost/asio/detail/fenced_block.hpp>
