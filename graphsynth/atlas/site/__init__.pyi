from .building import SiteReport as SiteReport
from .building import build_site as build_site
