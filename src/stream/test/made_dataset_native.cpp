#include "hills.h"
#include "made_dataset.h"

namespace terrane {

std::string madeDataset(const TemporaryDirectory& folder) {
  const std::string directory = folder.file("made.terrane");
  const Status built = buildHills(directory);
  TERRANE_CHECK(built.ok(), "{}", built.error().message);
  return directory;
}

}  // namespace terrane
