#!/usr/bin/python3
"""sign_in_day.py PAGE PAGE_BY_HTTPS ADMIN_LINK PICTURES: signing in and out on the page, here and elsewhere.

anna is an operator, "walnut and maple" her password. Each step waits for what the page shows, never for a time.
"""
import sys

from console_day import Day


class SignInDay(Day):
    def __init__(self, page, pictures):
        # The cell signs its certificate itself.
        super().__init__(page, pictures, "--ignore-certificate-errors")

    def fill(self, css, text):
        self.until(css, lambda: self.browser.execute_script("return Boolean(document.querySelector(arguments[0]))", css))
        self.find(css).clear()
        self.find(css).send_keys(text)

    def sign_in(self, name, password):
        self.fill("#sign-in-name", name)
        self.fill("input[name=password]", password)
        self.press("#do-sign-in")

    def look(self):
        """Who has not signed in on the cell's machine looks, and each button says what it needs."""
        self.until_says("#role", "view only")
        self.until_says(".viewer", "To operate from this browser, sign in")
        self.go("run")
        self.until_says("main", "needs an operator")
        self.show("viewer")

    def here(self):
        self.go("account")
        self.sign_in("anna", "walnut and mable")
        self.until_says("#refusal", "The name or the password is not right: try again")
        self.show("sign-in")
        self.sign_in("Anna", "walnut and maple")
        self.until_says("#role", "you operate · anna")
        self.go("account")
        self.until_says("main", "user anna")
        assert self.browser.get_cookies() == [], "a cookie goes to every server of this host"
        self.show("account")
        self.press("#do-sign-out")
        self.until_says("#role", "view only")

    def elsewhere(self, page):
        """By HTTPS nothing is seen before, and no script sees the secret after."""
        self.browser.get(page)
        self.until_says("#state-reason", "Sign in to see the cell")
        assert self.text("#nav").strip() == "Account", self.text("#nav")
        self.until_says("#stop", "STOP")
        self.show("sign-in-elsewhere")
        self.press("#stop button")
        self.until_says("#stop-note", "STOP confirmed")
        self.sign_in("anna", "walnut and maple")
        self.until_says("#role", "you operate · anna")
        self.until_says("#live", "live")
        self.until("the state", lambda: "Connecting" not in self.text("#state-word"))
        assert self.browser.execute_script("return document.cookie") == ""
        assert self.browser.execute_script("return sessionStorage.length") == 0
        [cookie] = self.browser.get_cookies()
        assert cookie["httpOnly"] and cookie["secure"] and cookie["sameSite"] == "Strict", cookie
        self.go("account")
        self.press("#do-sign-out")
        self.until_says("#state-reason", "Sign in to see the cell")
        assert self.browser.get_cookies() == []

    def accounts(self, link):
        self.browser.get(link)
        self.until_says("#role", "you operate, and see to accounts")
        self.go("account")
        self.until_says("main", "anna")
        self.fill("#new-user", "berta")
        self.find("#new-role").send_keys("maintainer")
        self.find("form:has(#new-user) input[name=password]").send_keys("cherry and birch")
        self.press("#do-add-user")
        self.until_says("main", "berta may sign in as maintainer.")
        self.show("accounts")
        self.press("details:has(select[name=user]) summary")
        self.fill("input[name=token]", "press room")
        self.until("two drawings more", lambda: self.browser.execute_script(
            "window.drawn = (window.drawn || 0) + 1; return window.drawn > 30"))
        assert self.find("input[name=token]").is_displayed(), "what was unfolded is folded again"
        self.press("#do-new-token")
        self.until_says("main", "Copy it now, it is not shown again:")
        self.until_says("main", "of anna, viewer, until")

    def check_console(self):
        """As in the operator's day; here things are refused on purpose, and no camera is there to glance by."""
        errors = [entry["message"] for entry in self.browser.get_log("browser")
                  if entry["level"] == "SEVERE" and not any(code in entry["message"] for code in ("403", "404"))
                  and not ("glance.jpg" in entry["message"] and "503" in entry["message"])]
        assert not errors, errors


def main():
    page, elsewhere, link, pictures = sys.argv[1:]
    day = SignInDay(page, pictures)
    try:
        day.look()
        day.here()
        day.elsewhere(elsewhere)
        day.accounts(link)
        day.check_console()
    finally:
        day.browser.quit()


if __name__ == "__main__":
    main()
