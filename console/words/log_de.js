// Wovon die Zeilen des Protokolls handeln, nach den Namen, die das Protokoll behält. Nur mit dem Protokoll geholt.
export const names = {
  // Anfragen, nach ihren Namen in docs/openapi.json
  "api.openSession": "Anmelden", "api.closeSession": "Abmelden", "api.changePassword": "Eigenes Passwort ändern", "api.addUser": "Benutzer anlegen", "api.removeUser": "Benutzer entfernen", "api.setUserRole": "Rolle eines Benutzers setzen", "api.setUserPassword": "Passwort eines Benutzers setzen",
  "api.newToken": "Token anlegen", "api.revokeToken": "Token widerrufen", "api.newConsoleLink": "Konsolenlink anlegen", "api.endConsoleLinks": "Alle Konsolenlinks beenden",
  "api.stop": "STOP", "api.command": "Befehl", "api.restart": "Programm der Zelle neu starten", "api.chooseDevice": "Gerät wählen", "api.findScanners": "Nach Scannern suchen", "api.findCameras": "Nach Kameras suchen", "api.tryCamera": "Durch eine Kamera sehen", "api.lookAtBed": "Das Bett ansehen",
  "api.scan": "Scannen", "api.acceptProposal": "Gescanntes annehmen", "api.refuseProposal": "Gescanntes ablehnen",
  "api.setPanelMaterial": "Holz einer Platte benennen", "api.drawZone": "Streifen einer Platte zeichnen", "api.setPanelFacts": "Etwas zu einer Platte notieren", "api.setMaterial": "Etwas zu einem Holz notieren", "api.editMask": "In die Maske einer Platte malen", "api.removeMaskEdit": "Gemaltes zurücknehmen", "api.revertPanel": "Eine frühere Fassung des Holzes gelten lassen",
  "api.mergePanels": "Zwei Platten zu einer machen", "api.splitPanel": "Notieren, dass eine Platte zersägt wurde", "api.retirePanel": "Platte aus dem Bestand nehmen", "api.restorePanel": "Platte zurück in den Bestand nehmen", "api.decideDifference": "Über einen Unterschied entscheiden",
  "api.setRecipe": "Rezept setzen", "api.removeRecipe": "Rezept entfernen", "api.drawTestCard": "Probekarte zeichnen", "api.burnTestCard": "Probekarte", "api.calibrate": "Kalibrieren",
  "api.laserTestPattern": "Testmuster", "api.laserRun": "Zeichnung am Laser", "api.readDrawing": "Zeichnung lesen", "api.laserCorner": "Sagen, dass der Kopf in der Ecke steht", "api.laserJog": "Kopf verfahren", "api.laserJogStop": "Kopf anhalten", "api.laserOverrides": "Tempo oder Leistung während des Laufs ändern",
  "api.newPlan": "Bild planen", "api.advisePlan": "Fragen, was erkennbar wäre", "api.sketchPlan": "Bild skizzieren", "api.sketchGrid": "Linien eines Bildes zeichnen", "api.sketchMosaic": "Zellen eines Bildes zeichnen", "api.removePlan": "Plan entfernen", "api.leasePlan": "Holz eines Plans vormerken", "api.releasePlan": "Holz eines Plans zurückgeben", "api.changePlan": "Plan ändern",
  "api.newJob": "Auftrag anlegen", "api.startJob": "Auftrag starten", "api.recut": "Stücke nochmals schneiden", "api.redo": "Stücke neu machen", "api.cancelJob": "Auftrag abbrechen", "api.moveJob": "Reihenfolge der Aufträge ändern", "api.archiveJob": "Auftrag ablegen", "api.unarchiveJob": "Auftrag aus der Ablage holen", "api.archiveDoneJobs": "Alles Fertige ablegen",
  "api.assemblePieces": "Stücke abhaken", "api.settleAsSeen": "Fragliche Stücke nehmen, wie der Scan sie sah", "api.settlePiece": "Sagen, was aus einem Stück wurde",
  "api.checkIntegrity": "Datenbank lesen lassen", "api.makeBackup": "Sicherung anlegen", "api.cancelTask": "Arbeit abbrechen",
  "api.makeSheet": "Simulierte Platte anlegen", "api.laySheet": "Simulierte Platte hinlegen", "api.liftSheet": "Simulierte Platte wegnehmen", "api.moveLid": "Simulierten Deckel bewegen",
  "api.acknowledgeAlarm": "Meldung zur Kenntnis nehmen", "api.acknowledgeAlarms": "Alle Meldungen zur Kenntnis nehmen", "api.tryNotices": "Benachrichtigung probieren",
  // Was die Zelle tat
  "cell.reset": "Reset", "cell.start": "Start", "cell.hold": "Anhalten (Hold)", "cell.unhold": "Weiter (Unhold)", "cell.unsuspend": "Schneiden beginnen", "cell.stop": "Hier beenden", "cell.stop-after-piece": "Nach diesem Stück beenden", "cell.abort": "STOP", "cell.clear": "Clear", "cell.recut": "Nochmals schneiden", "cell.frame": "Rahmen abfahren",
  "cell.write-off-look": "Geschuldeten Blick aufgegeben", "cell.recover": "Nach einem unsauberen Ende wiederhergestellt",
  "job.start": "Ein Auftrag begann", "job.recut": "Stücke werden nochmals geschnitten", "job.settle-as-seen": "Fragliche Stücke wurden genommen, wie ein Scan sie sah",
  "run.start": "Ein Lauf begann", "run.end": "Ein Lauf endete", "run.proven": "Die Lage wurde nach einem Lauf bestätigt",
  "laser.pattern": "Striche ohne Auftrag", "laser.check": "Die Steuerung liest Striche", "laser.jog": "Der Kopf wird verfahren", "laser.found": "Ein Laser wurde gefunden", "device.choose": "Ein Gerät wurde gewählt", "device.choose.failed": "Ein Gerät konnte nicht gewählt werden",
  "lease.end": "Vorgemerktes Holz wurde frei", "mask.withhold": "Holz wurde gesperrt", "mask.give": "Holz wurde freigegeben", "mask.take_back": "Gemaltes wurde zurückgenommen", "alarm.new": "Neue Meldung", "alarm.returned": "Eine Meldung ging von selbst", "task.unfinished": "Arbeit brach mit dem Ende des Programms ab", "store.restore": "Eine Sicherung wurde zurückgespielt",
};
// Wie eine Anfrage endete, hinter ihrem Namen.
export const ends = {done: "{what}: fertig", failed: "{what}: misslungen", cancelled: "{what}: abgebrochen", refused: "{what}: abgelehnt"};
