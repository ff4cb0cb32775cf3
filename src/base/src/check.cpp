#include "terrane/base/check.h"

#include <cstdio>
#include <cstdlib>

namespace terrane {

void failCheck(const char* condition, const char* file, int line, const std::string& message) {
  std::fprintf(stderr, "%s:%d: broken contract: %s%s%s\n", file, line, condition, message.empty() ? "" : ": ",
               message.c_str());
  std::abort();
}

}  // namespace terrane
