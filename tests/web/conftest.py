"""One studio for all that programs ask of it."""

import warnings

import pytest


@pytest.fixture(scope="package")
def program(tmp_path_factory, small_hand_file):
    """A program with a key, where the user has no hands of his own, but one that was named on the command line."""
    pytest.importorskip("starlette")
    pytest.importorskip("httpx")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # httpx is deprecated there for a package that few have yet
        from starlette.testclient import TestClient

    from handout.web.server import application
    from handout.web.studio import Studio

    class Program(TestClient):
        def sent(self, name, data):
            return self.post(f"/api/uploads?name={name}", content=data).json()["id"]

    with pytest.MonkeyPatch.context() as patch:
        for kind in ("CONFIG", "STATE"):
            patch.setenv(f"XDG_{kind}_HOME", str(tmp_path_factory.mktemp(kind.lower())))
        studio = Studio({small_hand_file.stem: small_hand_file})
        with Program(application(studio, 7217), base_url="http://127.0.0.1:7217") as client:
            client.headers["Authorization"] = f"Bearer {studio.new_key()}"
            client.studio = studio
            client.choices = client.get("/api/choices").json()
            yield client
