// What the log's rows are about, by the names that the audit keeps. Asked for with the Log only.
export const names = {
  // Requests, by their names in docs/openapi.json
  "api.openSession": "Sign in", "api.closeSession": "Sign out", "api.changePassword": "Change one's own password", "api.addUser": "Add a user", "api.removeUser": "Remove a user", "api.setUserRole": "Set a user's role", "api.setUserPassword": "Set a user's password",
  "api.newToken": "Make a token", "api.revokeToken": "Revoke a token", "api.newConsoleLink": "Make a console link", "api.endConsoleLinks": "End all console links",
  "api.stop": "STOP", "api.command": "Command", "api.restart": "Restart the cell's program", "api.chooseDevice": "Choose a device", "api.findScanners": "Look for scanners", "api.findCameras": "Look for cameras", "api.tryCamera": "Look through a camera", "api.lookAtBed": "Look at the bed",
  "api.scan": "Scan", "api.acceptProposal": "Accept what was scanned", "api.refuseProposal": "Refuse what was scanned",
  "api.setPanelMaterial": "Name a panel's wood", "api.drawZone": "Draw a zone of a panel", "api.setPanelFacts": "Note something about a panel", "api.setMaterial": "Note something about a wood", "api.editMask": "Paint on a panel's mask", "api.removeMaskEdit": "Take back what was painted", "api.revertPanel": "Let an earlier version of a panel's wood count",
  "api.mergePanels": "Make two panels one", "api.splitPanel": "Note that a panel was sawn apart", "api.retirePanel": "Take a panel out of stock", "api.restorePanel": "Put a panel back in stock", "api.decideDifference": "Decide about a difference",
  "api.setRecipe": "Set a recipe", "api.removeRecipe": "Remove a recipe", "api.drawTestCard": "Draw a test card", "api.burnTestCard": "Test card", "api.calibrate": "Calibrate",
  "api.laserTestPattern": "Test pattern", "api.laserRun": "Drawing at the laser", "api.readDrawing": "Read a drawing", "api.laserCorner": "Say that the head stands at the corner", "api.laserJog": "Move the head", "api.laserJogStop": "Stop moving the head", "api.laserOverrides": "Change speed or power while it runs",
  "api.newPlan": "Plan a picture", "api.advisePlan": "Ask what would be recognisable", "api.sketchPlan": "Sketch a picture", "api.sketchGrid": "Draw the lines of a picture", "api.sketchMosaic": "Draw the cells of a picture", "api.removePlan": "Remove a plan", "api.leasePlan": "Keep a plan's wood", "api.releasePlan": "Give a plan's wood back", "api.changePlan": "Change a plan",
  "api.newJob": "Make a job", "api.startJob": "Start a job", "api.recut": "Cut pieces once more", "api.redo": "Make pieces again", "api.cancelJob": "Cancel a job", "api.moveJob": "Change the order of the queue", "api.archiveJob": "Archive a job", "api.unarchiveJob": "Take a job out of the archive", "api.archiveDoneJobs": "Archive all that is done",
  "api.assemblePieces": "Tick pieces off", "api.settleAsSeen": "Take a scan's word for suspect pieces", "api.settlePiece": "Say what became of a piece",
  "api.checkIntegrity": "Have the database read", "api.makeBackup": "Make a backup", "api.cancelTask": "Break off work",
  "api.makeSheet": "Make a simulated sheet", "api.laySheet": "Lay a simulated sheet", "api.liftSheet": "Lift a simulated sheet", "api.moveLid": "Move the simulated lid",
  "api.acknowledgeAlarm": "Acknowledge an alarm", "api.acknowledgeAlarms": "Acknowledge all alarms", "api.tryNotices": "Try the notices",
  // What the cell did
  "cell.reset": "Reset", "cell.start": "Start", "cell.hold": "Hold", "cell.unhold": "Unhold", "cell.unsuspend": "Begin to cut", "cell.stop": "Stop", "cell.stop-after-piece": "Stop after this piece", "cell.abort": "STOP", "cell.clear": "Clear", "cell.recut": "Cut once more", "cell.frame": "Trace the frame",
  "cell.write-off-look": "Give up a look that was owed", "cell.recover": "Recovered after an unclean end",
  "job.start": "A job began", "job.recut": "Pieces are cut once more", "job.settle-as-seen": "Suspect pieces were settled as a scan saw them",
  "run.start": "A run began", "run.end": "A run ended", "run.proven": "The pose was proven after a run",
  "laser.pattern": "Strokes without a job", "laser.check": "The controller reads strokes", "laser.jog": "The head is moved", "laser.found": "A laser was found", "device.choose": "A device was chosen", "device.choose.failed": "A device could not be chosen",
  "lease.end": "Wood kept for a plan became free", "mask.withhold": "Wood was withheld", "mask.give": "Wood was given back to a panel", "mask.take_back": "What was painted was taken back", "alarm.new": "New alarm", "alarm.returned": "An alarm went by itself", "task.unfinished": "Work was broken off when the program ended", "store.restore": "A backup was restored",
};
// How a request ended, after its name.
export const ends = {done: "{what}: done", failed: "{what}: failed", cancelled: "{what}: broken off", refused: "{what}: refused"};
