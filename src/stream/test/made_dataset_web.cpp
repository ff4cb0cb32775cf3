#include "made_dataset.h"

namespace terrane {

std::string madeDataset(const TemporaryDirectory& /*folder*/) {
  return TERRANE_MADE_DATASET;
}

}  // namespace terrane
