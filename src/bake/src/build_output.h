#pragma once

#include <memory>
#include <string>

#include "job_log.h"
#include "terrane/base/progress.h"
#include "terrane/base/result.h"

namespace terrane {

/// Where a dataset is made: the folder `TARGET.partial` beside the place where it shall stand. It holds
///
///     plan       what shapes the result; work that was done for another plan is worth nothing, nor is work
///                from before the machine went down
///     jobs       which jobs are done (JobLog)
///     *.blocks   what lies between the steps (BlockStore)
///     dataset/   the files of the dataset; commit() renames this folder into place
///
/// The folder outlives the program where work was done in it, so that the next run goes on from there. Its
/// lock tells two builds of the same output apart; it vanishes with the program, however that ends.
class WorkFolder {
 public:
  /// Opens the folder that an earlier run left, or makes it. `plan`: all that shapes the result, as text;
  /// where the folder was left by another plan, its content is dropped, and `progress` is told.
  /// Errors: the target exists (and is no dataset, or may not be overwritten); another program works on it;
  /// the folder cannot be written, or is not what a build leaves.
  static Result<WorkFolder> open(const std::string& target, bool overwrite, const std::string& plan,
                                 Progress& progress);
  /// Removes the folder if it holds nothing to go on from.
  ~WorkFolder();
  WorkFolder(WorkFolder&& other) noexcept;
  WorkFolder& operator=(WorkFolder&&) = delete;

  const std::string& path() const { return path_; }
  /// A file of the dataset.
  std::string file(const std::string& name) const { return path_ + "/dataset/" + name; }
  JobLog& log() { return *log_; }
  /// Is there something to go on from?
  bool hasWork() const { return !path_.empty() && log_ != nullptr && !log_->empty(); }
  /// An earlier run has put the dataset in its place, and ended before it had tidied up.
  bool isCommitted() const;

  /// Makes a file of the dataset of these bytes, on disk when this returns.
  Status writeFile(const std::string& name, const std::string& text) const;
  /// Puts the dataset in its place, on disk when this returns; then removes what stood there, and all else in
  /// the folder. `manifest.json` must have been written.
  Status commit();
  /// Removes the folder: what is in it leads nowhere, or is no longer needed.
  void discard();

 private:
  WorkFolder(std::string target, std::string path, int lock);

  std::string target_;
  std::string path_;  ///< empty: nothing to look after any more
  int lock_ = -1;
  bool disposable_ = false;  ///< without work in it, the folder is worth nothing
  std::string plan_;
  std::unique_ptr<JobLog> log_;
};

/// May `target` be made, or replaced? Yes also where it stands because an earlier run had just made it.
Status checkTarget(const std::string& target, bool overwrite);
/// What a dataset at `target` is called: "alps" for "maps/alps.terrane/".
std::string datasetNameOf(const std::string& target);

/// The plan of an earlier run that has put the dataset at `target` in its place, and ended before it had
/// tidied up; else empty.
std::string committedPlan(const std::string& target);

/// Errors: the folder that shall hold `target` has fewer than `bytes` free, less what an earlier run has
/// written there already.
Status checkRoom(const WorkFolder& work, uint64_t bytes);

}  // namespace terrane
