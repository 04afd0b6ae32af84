// veneerctl panel, scanner and db: what comes into stock, and what is kept of it.
#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "base/files.h"
#include "tests/support/temp_directory.h"
#include "tests/support/veneerctl_run.h"

namespace veneer::daemon {
namespace {

using nlohmann::json;
using testing::ApiServer;
using testing::ask;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Outcome;
using testing::veneerctl;

TEST(VeneerctlStock, TheDatabaseIsCheckedOnDemand) {
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("checkIntegrity", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("integrity check", "");
      work.done({{"file", "veneerd.db"}, {"seconds", 1.24}, {"sound", true}});
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const Outcome outcome = ask(server, {"db", "check"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "The database is as it was written; reading it took 1.2 s.\n");
}

json made_backup() {
  return {{"name", "2026-05-01T07-30-00.000Z"},
          {"folder", "/data/backups/2026-05-01T07-30-00.000Z"},
          {"made_at", "2026-05-01T07:30:00.000Z"},
          {"bytes", 12'345'678},
          {"schema", 11},
          {"panels", 2},
          {"jobs", 1},
          {"pieces", 16},
          {"files", 7},
          {"missing", json::array()},
          {"removed", {"2026-04-17T07-30-00.000Z"}}};
}

Outcome ask_for_backup(const json& made) {
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("makeBackup", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("backup", "");
      work.done(made);
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  return ask(server, {"db", "backup"});
}

TEST(VeneerctlStock, ABackupIsToldWithWhatItHolds) {
  const Outcome outcome = ask_for_backup(made_backup());
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out,
            "The backup /data/backups/2026-05-01T07-30-00.000Z was made and checked: 12.3 MB, 2 panels, 1 jobs, 16 "
            "pieces, 7 pictures.\n1 older one was removed.\n");
}

TEST(VeneerctlStock, ABackupThatLacksPicturesFailsSoThatSomebodyLooks) {
  json made = made_backup();
  made["missing"] = {"panels/P-0001/map-1.png", "scans/show-2.png"};
  const Outcome outcome = ask_for_backup(made);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.out, HasSubstr("was made and checked"));
  EXPECT_EQ(outcome.err,
            "veneerctl: 2 pictures that the database names are missing or damaged in the data folder, the first is "
            "panels/P-0001/map-1.png: put them back from an older backup; the newest that still has one of "
            "them is kept until then\n");
}

TEST(VeneerctlStock, BackupsAreListed) {
  json unreadable = {{"name", "2026-04-30T07-30-00.000Z"},
                     {"folder", "/data/backups/2026-04-30T07-30-00.000Z"},
                     {"fault", "its manifest is damaged"}};
  json list = {{"folder", "/data/backups"}, {"backups", {made_backup(), unreadable}}};
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("listBackups", [&](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(list)); });
  });
  const Outcome outcome = ask(server, {"db", "backups"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_THAT(outcome.out,
              HasSubstr("2026-05-01T07:30:00.000Z  12.3 MB       2     1      16         7  /data/backups"));
  EXPECT_THAT(outcome.out, HasSubstr("its manifest is damaged"));
  list["backups"] = json::array();
  EXPECT_EQ(ask(server, {"db", "backups"}).out, "No backups in /data/backups: veneerctl db backup makes one.\n");
}

// Scripts read the exit status: what waits is not in stock.
TEST(VeneerctlStock, AScanThatWaitsThoughItWasToBeAcceptedFails) {
  ApiServer* running = nullptr;
  json asked;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("scan", [&](const ApiRequest& request, const Reply& reply) {
      asked = json::parse(request.body.text());
      const TaskReporter work = running->tasks().start("scan", "");
      work.done({{"proposal", 3}, {"new", true}, {"warnings", {{{"name", "size"}, {"text", "not round"}}}}});
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const Outcome looked = ask(server, {"panel", "scan"});
  EXPECT_EQ(looked.status, 0);
  EXPECT_THAT(looked.out, HasSubstr("panel accept 3 --override size"));
  EXPECT_FALSE(asked.contains("accept"));
  const Outcome outcome = ask(server, {"panel", "scan", "--accept"});
  EXPECT_EQ(asked["accept"], true);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_THAT(outcome.err, HasSubstr("proposal 3 has warnings, and is not in stock"));
  ask(server, {"panel", "scan", "--override", "size", "--override", "strip-1"});
  EXPECT_EQ(asked["override"], json({"size", "strip-1"}));
  EXPECT_EQ(ask(server, {"panel", "scan", "--accept", "--more"}).status, 2);
}

TEST(VeneerctlStock, SaysWhichStripsAreWoodAndWhereOneLies) {
  json asked;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("acceptProposal", [&](const ApiRequest& request, const Reply& reply) {
      asked = json::parse(request.body.text());
      const TaskReporter work = running->tasks().start("accept", "");
      work.done({{"panel", "P-0001"}, {"new", true}});
      reply(ApiReply::task(work.id()));
    });
    router.bind("drawZone", [&](const ApiRequest& request, const Reply& reply) {
      asked = json::parse(request.body.text());
      reply(ApiReply::json(
          {{"panel", "P-0001"},
           {"zones", {{{"zone", 2}, {"material", nullptr}, {"area_mm2", 1200}, {"confidence", 0.75}}}}}));
    });
  });
  running = &server;
  const Outcome accepted = ask(server, {"panel", "accept", "3", "--wood", "strip-1", "--no-wood", "strip-2"});
  EXPECT_EQ(accepted.status, 0) << accepted.err;
  EXPECT_EQ(asked, (json{{"wood", {"strip-1"}}, {"no_wood", {"strip-2"}}}));
  const Outcome drawn = ask(server, {"panel", "zone", "P-0001", "--zone", "2", "--outline", "10,5 40,5 40,45"});
  EXPECT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_EQ(asked, (json{{"zone", 2}, {"outline_mm", {10.0, 5.0, 40.0, 5.0, 40.0, 45.0}}}));
  EXPECT_THAT(drawn.out, HasSubstr("75 %"));
  EXPECT_EQ(ask(server, {"panel", "zone", "P-0001", "--outline", "1,2 3,4"}).status, 2);
}

TEST(VeneerctlStock, APanelsPicturesAreWhatTheirFilesAreCalled) {
  ApiServer server({}, {}, [](Router& router) {
    router.bind("getPanel", [](const ApiRequest&, const Reply& reply) { reply(ApiReply::json({{"id", "P-0001"}})); });
    for (const char* operation : {"getPanelMap", "getPanelMapJpeg", "getPanelStock", "getPanelStockJpeg"})
      router.bind(operation,
                  [operation](const ApiRequest&, const Reply& reply) { reply(ApiReply::bytes(operation, "image/x")); });
  });
  const testing::TempDirectory folder;
  const auto saved = [&](const char* option, const char* name) {
    const std::string file = (folder / name).string();
    ask(server, {"panel", "show", "P-0001", option, file});
    return read_whole(file).value_or("");
  };
  EXPECT_EQ(saved("--map", "map.jpg"), "getPanelMapJpeg");
  EXPECT_EQ(saved("--map", "map.png"), "getPanelMap");
  EXPECT_EQ(saved("--stock", "stock.jpeg"), "getPanelStockJpeg");
  EXPECT_EQ(saved("--stock", "stock"), "getPanelStock");
}

TEST(VeneerctlStock, PaintsOnMasks) {
  std::vector<std::string> asked;
  ApiServer server({}, {}, [&](Router& router) {
    for (const char* operation : {"editMask", "removeMaskEdit", "listMaskEdits", "getMaskEdit", "mergePanels"})
      router.bind(operation, [&asked](const ApiRequest& request, const Reply& reply) {
        asked.push_back(request.method + " " + request.path + " " + request.body.text());
        json told = {{"panel", "P-0001"}, {"edits", json::array()}};
        if (request.path.ends_with("/2")) told["shape_mm"] = {{{1, 2}, {30.5, 2}, {30, 40}}};
        reply(ApiReply::json(told));
      });
  });
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--give", "1,2 30.5,2 30,40"}).status, 0);
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--withhold", "1,2 30,2 30,40", "--note", "a stain"}).status, 0);
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--list"}).status, 0);
  EXPECT_THAT(ask(server, {"panel", "mask", "P-0001", "--show", "2"}).out, HasSubstr("1,2 30.5,2 30,40"));
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--remove", "2"}).status, 0);
  EXPECT_EQ(ask(server, {"panel", "merge", "P-0001", "P-0002"}).status, 0);
  EXPECT_THAT(
      asked, ::testing::ElementsAre("POST /api/v1/panels/P-0001/mask-edits "
                                    R"({"kind":"give","outline_mm":[1.0,2.0,30.5,2.0,30.0,40.0]})",
                                    "POST /api/v1/panels/P-0001/mask-edits "
                                    R"({"kind":"withhold","note":"a stain","outline_mm":[1.0,2.0,30.0,2.0,30.0,40.0]})",
                                    "GET /api/v1/panels/P-0001/mask-edits ", "GET /api/v1/panels/P-0001/mask-edits/2 ",
                                    "DELETE /api/v1/panels/P-0001/mask-edits/2 ",
                                    R"(POST /api/v1/panels/P-0001/merge {"merged":"P-0002"})"));
  for (const char* bad : {"1,2 3,4", "1,2 3,4 5", "1;2 3;4 5;6", "a,b c,d e,f"})
    EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--give", bad}).status, 2) << bad;
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--give", "1,2 3,4 5,6", "--remove", "1"}).status, 2);
  EXPECT_EQ(ask(server, {"panel", "mask", "P-0001", "--list", "--show", "1"}).status, 2);
}

TEST(VeneerctlStock, ListsScannersWithWhatTheyTake) {
  ApiServer* running = nullptr;
  const json found = {
      {"scanners",
       {{{"name", "epson2:libusb:001:004"},
         {"make", "EPSON Perfection V39"},
         {"type", "flatbed scanner"},
         {"problem", ""},
         {"options",
          {{{"name", "resolution"}, {"kind", "whole"}, {"unit", "dpi"}, {"value", "75"}, {"numbers", {75, 300, 600}}},
           {{"name", "mode"}, {"kind", "text"}, {"value", "Gray"}, {"words", {"Gray", "Color"}}},
           {{"name", "br-x"},
            {"kind", "number"},
            {"unit", "mm"},
            {"range", {{"least", 0}, {"most", 215.9}, {"step", 0}}}},
           {{"name", "lamp"}, {"kind", "yes_no"}, {"active", false}}}}},
        {{"name", "net:x:y"},
         {"make", "HP"},
         {"type", "scanner"},
         {"problem", "it is busy"},
         {"options", json::array()}}}}};
  json answer = found;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("findScanners", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("find scanners", "");
      work.done(answer);
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  const std::string list = ask(server, {"scanner", "list"}).out;
  EXPECT_EQ(list,
            "epson2:libusb:001:004\n"
            "  EPSON Perfection V39, flatbed scanner\n"
            "  resolution         75, 300, 600 dpi [75]\n"
            "  mode               \"Gray\", \"Color\" [Gray]\n"
            "  br-x               0 to 215.9 mm\n"
            "\n"
            "net:x:y\n"
            "  HP, scanner\n"
            "  it is busy\n");
  EXPECT_THAT(ask(server, {"scanner", "list", "--all"}).out,
              HasSubstr("lamp               true, false, with another source or mode only\n"));
  EXPECT_EQ(json::parse(ask(server, {"--json", "scanner", "list"}).out)["scanners"], found["scanners"]);
  answer = {{"scanners", json::array()}};
  EXPECT_THAT(ask(server, {"scanner", "list"}).out, HasSubstr("No scanner is found."));
}

TEST(VeneerctlStock, CamerasAreListedWithWhatToWriteAndWhatTheyTake) {
  ApiServer* running = nullptr;
  const auto size = [](const char* code, int width, int height, int most) {
    return json{{"code", code},
                {"width", width},
                {"height", height},
                {"most_width", width * most},
                {"most_height", height * most},
                {"step_width", 1},
                {"step_height", 1}};
  };
  json answer = {
      {"cameras",
       {{{"device", "/dev/v4l/by-id/usb-Cam_4711-video-index0"},
         {"node", "/dev/video0"},
         {"name", "HD Webcam"},
         {"named_by", "serial_number"},
         {"problem", ""},
         {"formats", {size("MJPG", 1920, 1080, 1), size("YUYV", 1920, 1080, 1), size("YUYV", 640, 480, 1)}},
         {"controls",
          {{{"name", "auto_exposure"},
            {"kind", "choice"},
            {"value", 3},
            {"usual", 3},
            {"choices",
             {{{"value", 1}, {"title", "Manual Mode"}}, {{"value", 3}, {"title", "Aperture Priority Mode"}}}}},
           {{"name", "focus_absolute"},
            {"kind", "whole"},
            {"least", 0},
            {"most", 250},
            {"step", 5},
            {"value", 35},
            {"usual", 0}},
           {{"name", "privacy"}, {"kind", "yes_no"}, {"value", 0}, {"usual", 0}, {"settable", false}}}}},
        {{"device", "/dev/v4l/by-path/pci-1-video-index0"},
         {"node", "/dev/video2"},
         {"name", "Cheap Cam"},
         {"named_by", "socket"},
         {"problem", "it is used by another program"},
         {"formats", json::array()},
         {"controls", json::array()}},
        {{"device", ""},
         {"node", "/dev/video4"},
         {"name", "Sensor"},
         {"named_by", nullptr},
         {"problem", ""},
         {"formats", {size("RGB3", 32, 32, 10)}},
         {"controls", json::array()}}}}};
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("findCameras", [&](const ApiRequest&, const Reply& reply) {
      const TaskReporter work = running->tasks().start("find cameras", "");
      work.done(answer);
      reply(ApiReply::task(work.id()));
    });
  });
  running = &server;
  EXPECT_EQ(ask(server, {"camera", "list"}).out,
            "HD Webcam\n"
            "  device = \"/dev/v4l/by-id/usb-Cam_4711-video-index0\"\n"
            "  MJPG  1920 x 1080\n"
            "  YUYV  640 x 480, 1920 x 1080\n"
            "  auto_exposure                  1 (Manual Mode), 3 (Aperture Priority Mode), now 3, default 3\n"
            "  focus_absolute                 0 to 250 in steps of 5, now 35, default 0\n"
            "  privacy                        0 or 1, now 0, default 0, cannot be set\n"
            "\n"
            "Cheap Cam\n"
            "  device = \"/dev/v4l/by-path/pci-1-video-index0\"\n"
            "  (it has no serial number of its own: whatever is plugged into this socket is it)\n"
            "  it is used by another program\n"
            "\n"
            "Sensor\n"
            "  /dev/video4 is no name that lasts, and it has no other: install udev, then plug it in again\n"
            "  RGB3  32 x 32 to 320 x 320\n"
            "  (it has no setting of its exposure: if it changes that itself, nobody can switch that off)\n"
            "  (it has no setting of its focus: use it only if its lens does not move by itself)\n"
            "\n"
            "Next: veneerctl camera try DEVICE takes a picture with one of them and says how to choose it.\n");
  answer["cameras"].erase(0);
  EXPECT_THAT(ask(server, {"camera", "list"}).out, Not(HasSubstr("Next:"))) << "none of these can be tried";
  answer = {{"cameras", json::array()}};
  EXPECT_THAT(ask(server, {"camera", "list"}).out, HasSubstr("No camera is found."));
}

TEST(VeneerctlStock, ACameraIsTriedWithItsPictureAndChosenByIt) {
  const std::string name = "/dev/v4l/by-id/usb-Cam_4711-video-index0";
  json asked, chosen, doubts = json::array();
  std::string shown;
  ApiServer* running = nullptr;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("tryCamera", [&](const ApiRequest& request, const Reply& reply) {
      asked = json::parse(request.body.text(), nullptr, false);
      const TaskReporter work = running->tasks().start("try camera", "");
      work.done({{"trial", 12},
                 {"device", name},
                 {"width", 1920},
                 {"height", 1080},
                 {"format", "YUYV"},
                 {"settings", {{"exposure_time_absolute", "200"}, {"focus_absolute", "35"}}},
                 {"doubts", doubts}});
      reply(ApiReply::task(work.id()));
    });
    router.bind("getCameraTrial", [&](const ApiRequest& request, const Reply& reply) {
      shown = request.query.contains("trial") ? request.query.at("trial") : "";
      reply(ApiReply::bytes("a picture", "image/jpeg"));
    });
    router.bind("chooseDevice", [&](const ApiRequest& request, const Reply& reply) {
      chosen = json::parse(request.body.text(), nullptr, false);
      reply(ApiReply::json({{"camera",
                             {{"kind", "v4l2"},
                              {"set_by", "choice"},
                              {"device", name},
                              {"width", 640},
                              {"height", 480},
                              {"format", "MJPG"},
                              {"settings", {{"focus_absolute", "35"}}}}},
                            {"next", nullptr}}));
    });
  });
  running = &server;
  EXPECT_EQ(ask(server, {"camera", "try", name}).out,
            name +
                "\n  1920 x 1080 YUYV, exposure_time_absolute 200, focus_absolute 35\n"
                "Nobody has seen this picture: take it again with --out FILE, look at it, then choose the camera.\n");
  EXPECT_EQ(asked, json({{"device", name}}));
  doubts = {"too_dark", "blurred", "unsettled", "too_bright"};
  const testing::TempDirectory folder;
  const std::string file = (folder / "bed.jpg").string();
  const std::string out = ask(server, {"camera", "try", name, "--width", "640", "--height", "480", "--format", "MJPG",
                                       "--set", "focus_absolute=30", "--set", "gain=0", "--out", file})
                              .out;
  EXPECT_EQ(asked, json({{"device", name},
                         {"width", 640},
                         {"height", 480},
                         {"format", "MJPG"},
                         {"settings", {"focus_absolute=30", "gain=0"}}}));
  for (const char* words : {"too dark", "less sharp", "never came to rest", "too bright", "The picture so taken: "})
    EXPECT_THAT(out, HasSubstr(words));
  EXPECT_THAT(out, HasSubstr("Next, when the picture is good: veneerctl device choose camera v4l2 \"" + name +
                             "\" --trial 12\n"));
  EXPECT_EQ(shown, "12");
  EXPECT_EQ(read_whole(file).value_or(""), "a picture");
  asked = nullptr;
  EXPECT_NE(ask(server, {"camera", "try", name, "--set", "gain=0", "bed.jpg"}).status, 0);
  EXPECT_EQ(asked, nullptr) << "what is no setting was taken for one";
  EXPECT_THAT(ask(server, {"device", "choose", "camera", "v4l2", name, "--trial", "12"}).out,
              HasSubstr("v4l2 " + name + ", 640 x 480 MJPG, focus_absolute 35"));
  EXPECT_EQ(chosen, json({{"kind", "v4l2"}, {"device", name}, {"trial", 12}}));
}

TEST(VeneerctlStock, DevicesAreListedWithWhySoAndChosenForTheNextStart) {
  const json sim = {{"kind", "sim"}, {"set_by", "nobody"}, {"device", ""}, {"dpi", 300}};
  json told = {{"laser", {{"kind", "grbl"}, {"set_by", "file"}, {"port", "tcp:10.0.0.1:23"}}},
               {"scanner", sim},
               {"camera", sim},
               {"file", "/etc/veneerd/veneerd.toml"},
               {"next", nullptr},
               {"problem", ""},
               {"restart_refused", ""}};
  json asked;
  ApiServer server({}, {}, [&](Router& router) {
    router.bind("getDevices", [&](const ApiRequest&, const Reply& reply) { reply(ApiReply::json(told)); });
    router.bind("findDevices", [&](const ApiRequest&, const Reply& reply) {
      reply(ApiReply::json({{"lasers",
                             {{{"kind", "lihuiyu"},
                               {"port", "usb:1a86:5512@1-2"},
                               {"name", ""},
                               {"named_by", "socket"},
                               {"refusal", ""}},
                              {{"kind", "grbl"},
                               {"port", "serial:/dev/ttyUSB0"},
                               {"name", "CH340"},
                               {"named_by", nullptr},
                               {"refusal", "it has no name that lasts"}}}},
                            {"pictures", json::array()}}));
    });
    router.bind("chooseDevice", [&](const ApiRequest& request, const Reply& reply) {
      asked = json::parse(request.body.text(), nullptr, false);
      told["next"] = {{"laser", told["laser"]}, {"scanner", {{"kind", "sane"}, {"device", "X"}}}, {"camera", sim}};
      reply(ApiReply::json(told));
    });
  });
  const std::string list = ask(server, {"device", "list"}).out;
  EXPECT_THAT(list, HasSubstr("grbl tcp:10.0.0.1:23"));
  EXPECT_THAT(list, HasSubstr("written in /etc/veneerd/veneerd.toml"));
  EXPECT_THAT(list, HasSubstr("nothing is chosen"));
  const std::string found = ask(server, {"device", "find"}).out;
  EXPECT_THAT(found, HasSubstr("device choose laser lihuiyu \"usb:1a86:5512@1-2\""));
  EXPECT_THAT(found, HasSubstr("leave it plugged in there"));
  EXPECT_THAT(found, HasSubstr("# serial:/dev/ttyUSB0, CH340: it has no name that lasts"));
  const std::string chosen = ask(server, {"device", "choose", "scanner", "sane", "X", "--dpi", "600"}).out;
  EXPECT_THAT(chosen, HasSubstr("sane X"));
  EXPECT_THAT(chosen, HasSubstr("Next: veneerctl restart"));
  EXPECT_EQ(asked, json({{"kind", "sane"}, {"device", "X"}, {"dpi", 600.0}}));
}

}  // namespace
}  // namespace veneer::daemon
