from . import gallery as gallery
