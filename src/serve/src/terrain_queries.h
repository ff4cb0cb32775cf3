#pragma once

#include <string>

#include "query_request.h"
#include "terrane/base/result.h"

namespace terrane {
class SurfaceTiles;
}

namespace terrane::serve {

class Geographic;

/// Answers a question to the dataset that is served as `name` with a JSON object: numbers, the bound they
/// hold to, null where there is no ground. The refusal is of a CRS that PROJ does not know, of places that
/// the dataset's CRS does not have, or of lines that are too long; the Result's error is of tiles that cannot
/// be read. Any thread; takes from microseconds to about a second.
Result<QueryResult<std::string>> answerQuery(const QueryRequest& query, const std::string& name,
                                             SurfaceTiles& tiles, Geographic& geographic,
                                             const QueryLimits& limits);

}  // namespace terrane::serve
