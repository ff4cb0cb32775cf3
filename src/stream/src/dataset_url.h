#pragma once

#include <string>

namespace terrane {

/// Where a dataset's files are on a server. "https://host/alps.terrane/?key=1", with or without the slash or
/// "manifest.json" behind it, has its elevation at "https://host/alps.terrane/elevation.pmtiles?key=1".
struct DatasetUrl {
  std::string folder;  ///< without a slash at its end
  std::string query;   ///< "?key=1", or empty
  std::string shown;   ///< the folder as messages may show it: no query, no user, no password

  std::string fileUrl(const std::string& file) const { return folder + "/" + file + query; }
};

/// Takes an address apart; a fragment is dropped. Whether it is well-formed is the HTTP library's to say.
DatasetUrl parseDatasetUrl(const std::string& url);

}  // namespace terrane
