#include <emscripten.h>

#include "cpu_time.h"

// note: emscripten's clocks all tell the time of day.
EM_JS(double, nodeCpuMicroseconds, (), {
  const used = process.cpuUsage();
  return used.user + used.system;
});

namespace terrane {

double threadSeconds() {
  return 1e-6 * nodeCpuMicroseconds();
}

}  // namespace terrane
