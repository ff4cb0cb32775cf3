-- wrk: sends requests that bench/serve.py wrote to a file, "PATH" or "PATH<TAB>RANGE" a line, in an order of its own
-- for each thread, always the same; ends with one line of JSON.
local count = 0
function setup(thread)
  count = count + 1
  thread:set("seed", count)
end

local requests = {}
local next_request
function init(args)
  for line in io.lines(args[1]) do
    local path, range = line:match("^([^\t]+)\t?(.*)$")
    local headers = {}
    if range ~= "" then headers["Range"] = "bytes=" .. range end
    requests[#requests + 1] = wrk.format("GET", path, headers)
  end
  math.randomseed(7 + seed)
  next_request = math.random
end

function request()
  return requests[next_request(#requests)]
end

function done(summary, latency)
  local e = summary.errors
  io.write(string.format(
    'RESULT {"requests": %d, "bytes": %d, "us": %d, "errors": %d, "p50_us": %.1f, "p99_us": %.1f}\n',
    summary.requests, summary.bytes, summary.duration, e.connect + e.read + e.write + e.status + e.timeout,
    latency:percentile(50), latency:percentile(99)))
end
